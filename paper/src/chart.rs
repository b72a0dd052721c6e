//! Line charts as SVG: a scale of named ticks below, 0 to 1 upwards, a legend below.

use std::fmt::Write;

/// A chart whose ticks stand at equal distances, as in the paper's Figure 8.
pub struct Chart<'a> {
    pub title: &'a str,
    pub x_label: &'a str,
    pub y_label: &'a str,
    pub ticks: &'a [String],
    pub series: Vec<Series>,
}

/// Points of one kind: at a tick, a value from 0 to 1.
pub struct Series {
    pub name: String,
    pub style: Style,
    pub points: Vec<(usize, f64)>,
}

/// How points are drawn.
#[derive(Clone, Copy)]
pub struct Style {
    /// A colour of SVG.
    pub colour: &'static str,
    pub marker: Marker,
    /// How the line is dashed; none if the points are not to be joined.
    pub line: Option<&'static str>,
}

#[derive(Clone, Copy)]
pub enum Marker {
    Disc,
    Square,
    /// Not filled, and a little larger.
    Diamond,
}

const SIZE: [f64; 2] = [640.0, 520.0];
/// The frame's left, top, right and bottom.
const FRAME: [f64; 4] = [76.0, 48.0, 620.0, 372.0];
/// From the frame to the first and the last tick.
const INSET: f64 = 24.0;

impl Chart<'_> {
    /// The chart as a file.
    pub fn svg(&self) -> String {
        let [width, height] = SIZE;
        let mut out = format!(
            "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 {width} {height}\" width=\"{width}\" \
             height=\"{height}\" font-family=\"system-ui, 'DejaVu Sans', sans-serif\" font-size=\"13\" \
             fill=\"#222\">\n<rect width=\"{width}\" height=\"{height}\" fill=\"#fff\"/>\n"
        );
        self.axes(&mut out);
        self.series.iter().for_each(|series| self.draw(series, &mut out));
        self.legend(&mut out);
        out.push_str("</svg>\n");
        out
    }

    /// Where a value at a tick is.
    fn place(&self, tick: usize, value: f64) -> [f64; 2] {
        let [left, top, right, bottom] = FRAME;
        let gaps = self.ticks.len().saturating_sub(1).max(1) as f64;
        let across = (right - left - 2.0 * INSET) * tick as f64 / gaps;
        [left + INSET + across, bottom - (bottom - top) * value]
    }

    fn axes(&self, out: &mut String) {
        let [left, top, right, bottom] = FRAME;
        text(out, [(left + right) / 2.0, 28.0], "middle", "font-size=\"15\" font-weight=\"600\"", self.title);
        for step in 0..=5 {
            let value = f64::from(step) / 5.0;
            let [_, y] = self.place(0, value);
            line(out, [left, y, right, y], if step == 0 { "#444" } else { "#ddd" });
            text(out, [left - 10.0, y + 4.5], "end", "", &format!("{value:.1}"));
        }
        for (i, tick) in self.ticks.iter().enumerate() {
            let [x, _] = self.place(i, 0.0);
            line(out, [x, bottom, x, bottom + 6.0], "#444");
            text(out, [x, bottom + 23.0], "middle", "", tick);
        }
        line(out, [left, top, left, bottom], "#444");
        text(out, [(left + right) / 2.0, bottom + 52.0], "middle", "", self.x_label);
        let [x, y] = [24.0, (top + bottom) / 2.0];
        text(out, [x, y], "middle", &format!("transform=\"rotate(-90 {x} {y})\""), self.y_label);
    }

    fn draw(&self, series: &Series, out: &mut String) {
        let places: Vec<[f64; 2]> = series.points.iter().map(|&(tick, v)| self.place(tick, v)).collect();
        stroke(out, &places, series.style);
        places.iter().for_each(|&at| marker(out, at, series.style));
    }

    /// Below the chart, two names a line.
    fn legend(&self, out: &mut String) {
        let [left, _, right, bottom] = FRAME;
        for (i, series) in self.series.iter().enumerate() {
            let x = left + (right - left) / 2.0 * (i % 2) as f64;
            let y = bottom + 84.0 + 23.0 * (i / 2) as f64;
            stroke(out, &[[x, y], [x + 34.0, y]], series.style);
            marker(out, [x + 17.0, y], series.style);
            text(out, [x + 44.0, y + 4.5], "start", "", &series.name);
        }
    }
}

fn line(out: &mut String, [x1, y1, x2, y2]: [f64; 4], colour: &str) {
    put(
        out,
        format_args!(
            "<line x1=\"{x1:.1}\" y1=\"{y1:.1}\" x2=\"{x2:.1}\" y2=\"{y2:.1}\" stroke=\"{colour}\"/>\n"
        ),
    );
}

fn stroke(out: &mut String, places: &[[f64; 2]], style: Style) {
    let Some(dash) = style.line else { return };
    let points: Vec<String> = places.iter().map(|[x, y]| format!("{x:.1},{y:.1}")).collect();
    let dash = if dash.is_empty() { String::new() } else { format!(" stroke-dasharray=\"{dash}\"") };
    put(
        out,
        format_args!(
            "<polyline points=\"{}\" fill=\"none\" stroke=\"{}\" stroke-width=\"2\"{dash}/>\n",
            points.join(" "),
            style.colour
        ),
    );
}

fn marker(out: &mut String, [x, y]: [f64; 2], Style { colour, marker, .. }: Style) {
    match marker {
        Marker::Disc => {
            put(out, format_args!("<circle cx=\"{x:.1}\" cy=\"{y:.1}\" r=\"4\" fill=\"{colour}\"/>\n"));
        }
        Marker::Square => put(
            out,
            format_args!(
                "<rect x=\"{:.1}\" y=\"{:.1}\" width=\"7\" height=\"7\" fill=\"{colour}\"/>\n",
                x - 3.5,
                y - 3.5
            ),
        ),
        Marker::Diamond => put(
            out,
            format_args!(
                "<path d=\"M{x:.1} {:.1}l6.5 6.5l-6.5 6.5l-6.5 -6.5z\" fill=\"none\" stroke=\"{colour}\" \
                 stroke-width=\"2\"/>\n",
                y - 6.5
            ),
        ),
    }
}

fn text(out: &mut String, [x, y]: [f64; 2], anchor: &str, more: &str, words: &str) {
    let words = words.replace('&', "&amp;").replace('<', "&lt;");
    put(
        out,
        format_args!("<text x=\"{x:.1}\" y=\"{y:.1}\" text-anchor=\"{anchor}\" {more}>{words}</text>\n"),
    );
}

fn put(out: &mut String, what: std::fmt::Arguments<'_>) {
    out.write_fmt(what).expect("a string takes all there is");
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn values_stand_where_the_axes_say() {
        let ticks = ["0 %", "1 %", "10 %"].map(str::to_owned);
        let style = Style { colour: "#c00", marker: Marker::Disc, line: Some("") };
        let series = Series { name: "a < b".into(), style, points: vec![(0, 1.0), (2, 0.0)] };
        let chart = Chart { title: "t", x_label: "x", y_label: "y", ticks: &ticks, series: vec![series] };
        let [left, top, right, bottom] = FRAME;
        assert_eq!(chart.place(0, 1.0), [left + INSET, top]);
        assert_eq!(chart.place(2, 0.0), [right - INSET, bottom]);
        assert_eq!(chart.place(1, 0.5), [(left + right) / 2.0, (top + bottom) / 2.0]);
        let svg = chart.svg();
        assert!(svg.contains(&format!("points=\"{:.1},{top:.1} ", left + INSET)), "{svg}");
        assert!(svg.contains("a &lt; b") && svg.contains(">10 %</text>"), "{svg}");
        // Two points and one in the legend.
        assert_eq!(svg.matches("<circle").count(), 3);
        assert!(svg.starts_with("<svg") && svg.ends_with("</svg>\n"));
    }
}
