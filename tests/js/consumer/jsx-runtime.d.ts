import type { JSX as ReactJSX } from "react";

export namespace JSX {
  export type Element = ReactJSX.Element;
  export type IntrinsicElements = ReactJSX.IntrinsicElements;
}
export const jsx: unknown;
export const jsxs: unknown;
