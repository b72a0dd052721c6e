// A theme of TypeDoc with the pages of `pages.json` under its headings, and a router with the names of their files.
// @ts-check
import { readFileSync } from "node:fs";
import { basename, relative } from "node:path";
import { fileURLToPath } from "node:url";
import { Converter, DefaultTheme, DocumentReflection, JSX, KindRouter, ReflectionKind } from "typedoc";

const root = fileURLToPath(new URL("../../", import.meta.url));
/** @type {Record<string, string[]>} */
const groups = JSON.parse(readFileSync(new URL("pages.json", import.meta.url), "utf8"));
/** @type {{ name: string, exports: Record<string, { types?: string }> }} */
const manifest = JSON.parse(readFileSync(new URL("../../pkg/package.json", import.meta.url), "utf8"));

/** The heading of the entries of the package. */
const API = "API";

/** The file of the repository that a page or module was made of. @param {import("typedoc").Reflection} reflection */
const source = (reflection) => {
  const file = reflection.project.files.getReflectionPath(reflection);
  return file && relative(root, file).replaceAll("\\", "/");
};

/** Headings that do not say what the page is where they stand among others. @type {Record<string, string>} */
const TITLES = {
  "pkg-template/README.md": "The npm package",
  "python/README.md": "The Python package",
  "examples/js/README.md": "Example projects: bundlers, React, Node",
};

/** The title of a page is its first heading. */
function title(page) {
  if (page in TITLES) return TITLES[page];
  const heading = /^# (.*)$/m.exec(readFileSync(root + page, "utf8"));
  if (!heading) throw new Error(`${page} has no heading`);
  return heading[1].replaceAll("`", "");
}

/** `docs/howto/three.md` is at `howto/three.html`, `CHANGELOG.md` at `changelog.html`. */
class Router extends KindRouter {
  /** @param {import("typedoc").Reflection} reflection */
  getIdealBaseName(reflection) {
    if (!(reflection instanceof DocumentReflection)) return super.getIdealBaseName(reflection);
    const page = source(reflection) ?? reflection.name;
    return page.replace(/^docs\//, "").replace("pkg-template/README", "package").replace("python/README", "python").replace("examples/js/README", "howto/examples").replace("editors/vscode/README", "howto/vscode").replace(/\.md$/, "").toLowerCase();
  }
}

class Theme extends DefaultTheme {
  /** @param {import("typedoc").ProjectReflection} project */
  buildNavigation(project) {
    const documents = new Map((project.documents ?? []).map((document) => [source(document), document]));
    const link = (/** @type {string} */ page) => {
      const document = documents.get(page);
      if (!document) throw new Error(`docs/site/pages.json names ${page}, which is not there`);
      return { text: document.name, path: this.router.getFullUrl(document), kind: ReflectionKind.Document };
    };
    const modules = super.buildNavigation(project).filter((element) => element.kind === ReflectionKind.Module);
    const order = Object.keys(manifest.exports).map((entry) => entry.replace(".", manifest.name));
    modules.sort((a, b) => order.indexOf(a.text) - order.indexOf(b.text));
    const pages = Object.entries(groups).map(([text, names]) => ({ text, children: names.map(link) }));
    const [first, ...others] = pages;
    return [{ text: "Start", path: "index.html" }, first, { text: API, children: modules }, ...others];
  }
}

/** Opens the groups at the first visit: the script of TypeDoc remembers here what is open. */
const OPEN = `for (const group of ${JSON.stringify([Object.keys(groups)[0], API])})
  localStorage.setItem("tsd-accordion-" + group, localStorage.getItem("tsd-accordion-" + group) ?? "true");`;

/** @param {import("typedoc").Application} app */
export function load(app) {
  app.renderer.defineTheme("tetralod", Theme);
  app.renderer.defineRouter("tetralod", Router);
  app.renderer.hooks.on("head.end", () => JSX.createElement("script", null, JSX.createElement(JSX.Raw, { html: `try {${OPEN}} catch {}` })));
  app.converter.on(Converter.EVENT_CREATE_DOCUMENT, (_context, document) => {
    const page = source(document);
    if (page) document.name = title(page);
  });
  // Modules have the names by which they are imported.
  const names = new Map(
    Object.entries(manifest.exports).map(([entry, { types }]) => [types?.replace(/^\./, "pkg"), entry.replace(".", manifest.name)]),
  );
  app.converter.on(Converter.EVENT_CREATE_DECLARATION, (_context, reflection) => {
    const name = reflection.kind === ReflectionKind.Module && names.get(source(reflection) ?? "");
    if (name) reflection.name = name;
  });
}

/**
 * Code in headings counts for their names, as on GitHub; a link to a page that is named by its file is named by its title.
 *
 * @param {any} parser of markdown-it
 */
export function readers(parser) {
  const titles = new Map(Object.values(groups).flat().filter((page) => !page.endsWith("README.md")).map((page) => [basename(page), title(page)]));
  parser.core.ruler.push("tetralod", (/** @type {any} */ state) => {
    for (const [i, block] of state.tokens.entries()) {
      if (block.type !== "inline") continue;
      const inHeading = state.tokens[i - 1].type === "heading_open";
      block.children = block.children.flatMap((/** @type {any} */ token, /** @type {number} */ k) => {
        const piece = (/** @type {string} */ type, /** @type {string} */ content) => Object.assign(new state.Token(type, "", 0), { content });
        if (token.type === "code_inline" && inHeading) {
          return [piece("html_inline", "<code>"), piece("text", token.content), piece("html_inline", "</code>")];
        }
        const page = token.type === "text" && block.children[k - 1]?.type === "link_open" && titles.get(basename(token.content));
        return page ? piece("text", page) : token;
      });
    }
  });
}
