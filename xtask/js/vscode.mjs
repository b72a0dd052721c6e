/**
 * Packs the extension for VS Code: `editors/vscode` with the page of `tetralod html`, the viewer and the builder. It is the same file each time.
 *
 * node xtask/js/vscode.mjs FOLDER_OF_THE_PACKAGE FILE.vsix
 */

import { mkdir, readFile, writeFile } from "node:fs/promises";
import { createRequire } from "node:module";
import { dirname, extname, join, resolve } from "node:path";
import { fileURLToPath } from "node:url";
import { bundled } from "./bundle.mjs";

// The tools of the project are those of its tests.
const tools = createRequire(new URL("../../tests/js/package.json", import.meta.url));
const { zipSync } = tools("fflate");

const [folder, file] = process.argv.slice(2).map((path) => resolve(path));
const own = (path) => fileURLToPath(new URL(`../../${path}`, import.meta.url));

const { version } = JSON.parse(await readFile(join(folder, "package.json"), "utf8"));
const manifest = { ...JSON.parse(await readFile(own("editors/vscode/package.json"), "utf8")), version };
const { name, displayName, description, publisher, categories, keywords, engines, extensionKind } = manifest;

const text = (value) => new TextEncoder().encode(value);
const extension = {
  "package.json": text(JSON.stringify(manifest, null, 2)),
  "README.md": await readFile(own("editors/vscode/README.md")),
  "extension.js": await readFile(own("editors/vscode/extension.js")),
  "page/page.js": await bundled(own("editors/vscode/page.mjs"), folder),
  "page/body.html": text((await readFile(own("cli/src/html/body.html"), "utf8")).replace("{version}", version)),
  "page/page.css": await readFile(own("cli/src/html/page.css")),
  "page/editor.css": await readFile(own("editors/vscode/editor.css")),
  "builder/package.json": text('{ "type": "module" }\n'),
  "builder/build.js": await bundled(join(folder, "build.js"), folder),
  "builder/build-worker.js": await bundled(join(folder, "build-worker.js"), folder),
  "builder/tetralod_build_bg.wasm": await readFile(join(folder, "tetralod_build_bg.wasm")),
};
for (const licence of ["LICENSE-MIT", "LICENSE-APACHE", "THIRD-PARTY-LICENSES.txt"]) extension[licence] = await readFile(join(folder, licence));

const escaped = (value) => String(value).replace(/[&<"]/g, (character) => `&#${character.charCodeAt(0)};`);
const NAMESPACE = "http://schemas.microsoft.com/developer/vsx-schema/2011";
const described = `<?xml version="1.0" encoding="utf-8"?>
<PackageManifest Version="2.0.0" xmlns="${NAMESPACE}">
  <Metadata>
    <Identity Language="en-US" Id="${name}" Version="${version}" Publisher="${publisher}"/>
    <DisplayName>${escaped(displayName)}</DisplayName>
    <Description xml:space="preserve">${escaped(description)}</Description>
    <Tags>${escaped(keywords)}</Tags>
    <Categories>${escaped(categories)}</Categories>
    <Properties>
      <Property Id="Microsoft.VisualStudio.Code.Engine" Value="${escaped(engines.vscode)}"/>
      <Property Id="Microsoft.VisualStudio.Code.ExtensionKind" Value="${escaped(extensionKind)}"/>
    </Properties>
    <License>extension/LICENSE-MIT</License>
  </Metadata>
  <Installation><InstallationTarget Id="Microsoft.VisualStudio.Code"/></Installation>
  <Dependencies/>
  <Assets>
    <Asset Type="Microsoft.VisualStudio.Code.Manifest" Path="extension/package.json" Addressable="true"/>
    <Asset Type="Microsoft.VisualStudio.Services.Content.Details" Path="extension/README.md" Addressable="true"/>
    <Asset Type="Microsoft.VisualStudio.Services.Content.License" Path="extension/LICENSE-MIT" Addressable="true"/>
  </Assets>
</PackageManifest>
`;
const inside = Object.fromEntries(Object.entries(extension).map(([path, bytes]) => [`extension/${path}`, bytes]));
const known = [...Object.keys(inside), "extension.vsixmanifest"].map((path) => extname(path)).filter((ending) => ending);
const types = `<?xml version="1.0" encoding="utf-8"?>
<Types xmlns="http://schemas.openxmlformats.org/package/2006/content-types">
${[...new Set(known)].map((ending) => `  <Default Extension="${ending}" ContentType="application/octet-stream"/>`).join("\n")}
</Types>
`;

const all = { "extension.vsixmanifest": text(described), "[Content_Types].xml": text(types), ...inside };
await mkdir(dirname(file), { recursive: true });
await writeFile(file, zipSync(all, { level: 9, mtime: new Date(1980, 0, 1) }));
