import { StrictMode, useEffect, useRef, useState } from "react";
import { createRoot } from "react-dom/client";
import "tetralod/element";
import { Viewer } from "tetralod/viewer";

function Volume({ src }) {
  const [isovalue, setIsovalue] = useState(0.5);
  const [tetrahedra, setTetrahedra] = useState(0);
  return (
    <>
      <tetralod-viewer src={src} isovalue={isovalue} error="1%" onstats={({ detail }) => setTetrahedra(detail.tetrahedra)} />
      <label>
        Isovalue <input type="range" max={1} step={0.01} value={isovalue} onChange={(event) => setIsovalue(event.target.value)} />
      </label>
      <p>{tetrahedra} tetrahedra</p>
    </>
  );
}

/** A viewer on a canvas of the component: `StrictMode` makes it, frees it and makes it again, on the same canvas. */
function Boundary({ src }) {
  const canvas = useRef(null);
  useEffect(() => {
    const control = new AbortController();
    const { signal } = control;
    let viewer;
    const show = async () => {
      viewer = await Viewer.create(canvas.current, { signal });
      await viewer.open(src, { signal, state: { isosurfaces: null, boundary: { edges: true } } });
    };
    show().catch((error) => signal.aborted || console.error(error));
    return () => {
      control.abort();
      viewer?.free();
    };
  }, [src]);
  return <canvas ref={canvas} aria-label="The boundary of the volume" />;
}

createRoot(document.querySelector("main")).render(
  <StrictMode>
    <Volume src="bucky.mt" />
    <Boundary src="bucky.mt" />
  </StrictMode>,
);
