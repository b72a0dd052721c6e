// The element in JSX: with the namespace of a library (React 19, Preact), as `react.d.ts` declares it.
import "tetralod/element";

export const Volume = (src: string, values: number[]) => (
  <tetralod-viewer src={src} isovalue={values} error="1%" max-tets={100_000} className="wide" onload={({ detail }) => void detail.info.kind} />
);

export const Cut = (src: string) => <tetralod-viewer src={src} request={{ error: "1%", maxTets: 100_000 }} state={{ boundary: {} }} />;

// @ts-expect-error there is no such mode
export const wrong = () => <tetralod-viewer mode="round" />;
