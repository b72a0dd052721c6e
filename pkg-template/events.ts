/** Types of the events of a class by their names, as the DOM has them for its own. */

/** A class whose objects are made without arguments. */
export type Class<T> = { new (): T; prototype: T };

/** What `addEventListener` takes of an object with the events `Events`: a map from their names to their types. */
export interface TypedEvents<Events> {
  addEventListener<K extends keyof Events & string>(
    type: K,
    listener: (event: Events[K]) => void,
    options?: boolean | AddEventListenerOptions,
  ): void;
  addEventListener(type: string, listener: EventListenerOrEventListenerObject | null, options?: boolean | AddEventListenerOptions): void;
}
