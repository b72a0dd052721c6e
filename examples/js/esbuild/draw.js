/** Draws a section across z: each triangle in the colour of its mean value. */
export function draw(canvas, { positions, values, indices }) {
  [canvas.width, canvas.height] = [480, 360];
  const context = canvas.getContext("2d");
  const x = (vertex) => 90 + 300 * positions[3 * vertex];
  const y = (vertex) => 330 - 300 * positions[3 * vertex + 1];
  for (let i = 0; i < indices.length; i += 3) {
    const [a, b, c] = indices.subarray(i, i + 3);
    context.beginPath();
    context.moveTo(x(a), y(a));
    context.lineTo(x(b), y(b));
    context.lineTo(x(c), y(c));
    context.fillStyle = context.strokeStyle = `hsl(${280 - 220 * ((values[a] + values[b] + values[c]) / 3)} 80% 45%)`;
    context.fill();
    context.stroke();
  }
}
