// The module that `cargo xtask bench --browser` makes in `target/bench`.
export default function init(): Promise<unknown>;
export function bench(bytes: Uint8Array, seconds: number): object;
