// What TypeDoc makes a site of: the pages of `pages.json`, and the types of every entry of the package in `pkg/`.
import { readFileSync } from "node:fs";
import { fileURLToPath } from "node:url";
import { readers } from "./theme.mjs";

const root = new URL("../../", import.meta.url);
const path = (name) => fileURLToPath(new URL(name, root));
const json = (name) => JSON.parse(readFileSync(new URL(name, root), "utf8"));

const { exports } = json("pkg/package.json");
// Scripts for workers have nothing to import.
const types = Object.values(exports).flatMap((entry) => (entry.types && entry.types !== "./worker.d.ts" ? entry.types : []));

/** @type {Partial<import("typedoc").TypeDocOptions>} */
export default {
  name: "tetralod",
  entryPoints: types.map((file) => path(`pkg/${file}`)),
  tsconfig: path("docs/site/tsconfig.json"),
  readme: path("docs/README.md"),
  projectDocuments: Object.values(json("docs/site/pages.json")).flat().map(path),
  plugin: [path("docs/site/theme.mjs")],
  theme: "tetralod",
  router: "tetralod",
  out: path("target/docs"),
  basePath: path("."),
  // Nothing may be fetched, and the same sources make the same site.
  disableGit: true,
  disableSources: true,
  githubPages: true,
  hideGenerator: false,
  headings: { readme: false, document: false },
  markdownItLoader: readers,
  markdownItOptions: { html: true, linkify: false },
  customCss: path("docs/site/site.css"),
  highlightLanguages: ["console", "dockerfile", "html", "javascript", "json", "jsx", "nginx", "python", "rust", "sh", "text", "typescript", "xml", "yaml"],
  searchInDocuments: true,
  navigation: { includeFolders: false },
  sort: ["kind", "source-order"],
  kindSortOrder: ["Module", "Class", "Function", "Variable", "Interface", "TypeAlias", "Constructor", "Property", "Accessor", "Method", "Reference"],
  excludePrivate: true,
  treatWarningsAsErrors: true,
  treatValidationWarningsAsErrors: true,
};
