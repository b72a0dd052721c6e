/** The version of the package: a worker of another version is refused. */
export const VERSION = "0.1.0";
