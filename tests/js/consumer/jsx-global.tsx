// The element in JSX whose namespace is global: React up to 18.
import "tetralod/element";

declare global {
  namespace JSX {
    interface Element {
      type: unknown;
    }
  }
}

export const Volume = (src: string) => <tetralod-viewer src={src} isovalue={0.5} background="light" />;

// @ts-expect-error a background is a word
export const wrong = () => <tetralod-viewer background={7} />;
