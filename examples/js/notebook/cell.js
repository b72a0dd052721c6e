// A cell imports from a CDN, that is from another origin: https://cdn.jsdelivr.net/npm/tetralod/element.js (not `+esm`).
await import("https://cdn.jsdelivr.net/npm/tetralod/element.js");
const viewer = document.createElement("tetralod-viewer");
viewer.style.width = "480px";
Object.assign(viewer, { src: "bucky.mt", mode: "slice", error: "2%" });
display(viewer);
invalidation.then(() => viewer.remove());
