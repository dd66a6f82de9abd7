/**
 * Bundles the studio's editor, and writes THIRD_PARTY_NOTICES from the licences of the packages in the bundle. Run from the
 * root: npm run bundle. An argument names another folder for both.
 */
import { build } from "esbuild";
import { readFileSync, readdirSync, writeFileSync } from "node:fs";
import { join } from "node:path";

const root = join(import.meta.dirname, "..");
const [bundle, notices] = process.argv[2]
  ? [join(process.argv[2], "editor.js"), join(process.argv[2], "THIRD_PARTY_NOTICES")]
  : [join(root, "socialai_dsl/studio/static/editor.js"), join(root, "THIRD_PARTY_NOTICES")];
const made = await build({
  absWorkingDir: root, entryPoints: ["editor/editor.js"], outfile: bundle,
  bundle: true, minify: true, format: "esm", legalComments: "inline", metafile: true,
});
const [{ inputs }] = Object.values(made.metafile.outputs);
const folders = Object.keys(inputs).filter((file) => inputs[file].bytesInOutput > 0).flatMap((file) => file.match(/^.*node_modules\/(?:@[^/]+\/)?[^/]+/) ?? []);
const texts = [...new Set(folders)].sort().map((folder) => {
  const { name, version, license } = JSON.parse(readFileSync(join(root, folder, "package.json"), "utf8"));
  const file = readdirSync(join(root, folder)).find((one) => /^licen[cs]e/i.test(one));
  if (!license || !file) throw new Error(`${name} has no licence to quote`);
  return `${name} ${version}, ${license}\n\n${readFileSync(join(root, folder, file), "utf8").trim()}\n`;
});
const line = `\n${"-".repeat(80)}\n\n`;
writeFileSync(notices, ["The studio's editor, socialai_dsl/studio/static/editor.js, contains code of the following packages.\n", ...texts].join(line));
