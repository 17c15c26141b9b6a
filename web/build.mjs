// Bundles the page into one file, dist/index.html: nothing to fetch, so that it runs from a binary, from a file and without a network. The same sources give
// the same bytes: no time, no path and no hash of the machine goes in.

import { mkdir, readFile, writeFile } from "node:fs/promises";
import { dirname, join } from "node:path";
import { fileURLToPath } from "node:url";
import { build } from "esbuild";

const here = dirname(fileURLToPath(import.meta.url));

async function bundle(entry) {
  const result = await build({
    absWorkingDir: here,
    entryPoints: [entry],
    bundle: true,
    write: false,
    minify: true,
    charset: "ascii",
    format: "iife",
    target: "chrome110",
    legalComments: "none",
    logLevel: "warning",
  });
  return result.outputFiles[0].text.trim();
}

/** What would end the element early, or open a comment in it, is written another way that means the same in a string or a regular expression. */
const inScript = (text) => text.replaceAll(/<\/(script)/gi, "<\\/$1").replaceAll("<!--", "<\\!--");
const inStyle = (text) => text.replaceAll(/<\/(style)/gi, "<\\/$1");

const [page, script, style, uplot, manifest] = await Promise.all([
  readFile(join(here, "index.html"), "utf8"),
  bundle("src/main.ts"),
  bundle("src/style.css"),
  readFile(join(here, "node_modules/uplot/LICENSE"), "utf8"),
  readFile(join(here, "node_modules/uplot/package.json"), "utf8"),
]);

function put(text, mark, replacement) {
  const parts = text.split(mark);
  if (parts.length !== 2) throw new Error(`index.html: ${mark} must stand there once`);
  return parts.join(replacement);
}

const licence = `<!--\nvehicle-controller: MIT OR Apache-2.0. With uPlot ${JSON.parse(manifest).version}:\n${uplot.trim()}\n-->`;
let out = put(page, '<link rel="stylesheet" href="src/style.css" />', `<style>${inStyle(style)}</style>`);
out = put(out, '<script type="module" src="src/main.ts"></script>', `<script>${inScript(script)}</script>`);
out = put(out, "<!-- licences -->", licence);

await mkdir(join(here, "dist"), { recursive: true });
await writeFile(join(here, "dist/index.html"), out);
console.log(`dist/index.html: ${(Buffer.byteLength(out) / 1024).toFixed(0)} kB`);
