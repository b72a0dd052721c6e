// What the types of React 19 have of JSX.
export namespace JSX {
  export interface Element {
    type: unknown;
  }
  export interface IntrinsicElements {
    div: { className?: string };
  }
}
