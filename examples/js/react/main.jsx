import { StrictMode, useState } from "react";
import { createRoot } from "react-dom/client";
import "tetralod/element";

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

createRoot(document.querySelector("main")).render(
  <StrictMode>
    <Volume src="bucky.mt" />
  </StrictMode>,
);
