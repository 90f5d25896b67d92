// Writes codemirror.js, one module without comments, and the licences of what it is made from, into the static files.
import { readdir, readFile, writeFile } from "node:fs/promises";
import { build } from "esbuild";

const STATIC = new URL("../vrg_class/static/", import.meta.url);

const { metafile } = await build({
  entryPoints: ["codemirror.js"], bundle: true, minify: true, format: "esm", target: "es2022", legalComments: "none",
  banner: { js: "// CodeMirror, MIT licence: see codemirror-LICENSE.txt. Built by plugins/vrg-class/editor." },
  outfile: new URL("codemirror.js", STATIC).pathname, metafile: true,
});

const used = Object.keys(metafile.inputs).map((path) => /^node_modules\/((@[^/]+\/)?[^/]+)\//.exec(path)?.[1]);
const texts = new Map();
for (const name of [...new Set(used.filter(Boolean))].sort()) {
  const folder = `node_modules/${name}`, { version } = JSON.parse(await readFile(`${folder}/package.json`));
  const file = (await readdir(folder)).find((one) => /^licen[cs]e/i.test(one));
  const text = (await readFile(`${folder}/${file}`, "utf8")).trim();
  texts.set(text, [...(texts.get(text) ?? []), `${name} ${version}`]);
}
const parts = [...texts].map(([text, names]) => `${names.join("\n")}\n\n${text}\n`);
await writeFile(new URL("codemirror-LICENSE.txt", STATIC), `codemirror.js is made from:\n\n${parts.join(`\n${"-".repeat(80)}\n\n`)}`);
