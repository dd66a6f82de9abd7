/** Bundles the plugin with the screen that participants see on a study's own page. Run from the root: npm run bundle. */
import { build } from "esbuild";
import { execFileSync } from "node:child_process";
import { copyFileSync, existsSync, mkdtempSync, rmSync } from "node:fs";
import { tmpdir } from "node:os";
import { join } from "node:path";

const own = import.meta.dirname, ours = join(own, "../../socialai_dsl");
const folders = [join(own, "src"), join(ours, "study/static"), join(ours, "traces/static"), join(ours, "study")];
/** Files of all these folders import each other as if they lay in one, as the server hands them out. */
const together = {
  name: "together",
  setup({ onResolve }) {
    onResolve({ filter: /^\.\// }, ({ path }) => ({ path: folders.map((folder) => join(folder, path)).find(existsSync) }));
  },
};
const out = process.argv[2] ?? join(own, "dist");
const ownAlone = {
  name: "own alone",
  setup({ onEnd }) {
    onEnd(({ metafile }) => {
      const foreign = Object.keys(metafile.inputs).filter((file) => file.includes("node_modules/"));
      if (foreign.length) throw new Error(`the banner says that it contains nothing of others, and it contains ${foreign}`);
    });
  },
};
const all = { entryPoints: [join(own, "src/index.js")], bundle: true, metafile: true, charset: "utf8", loader: { ".css": "text" }, plugins: [together, ownAlone], target: "es2022" };
const banner = { js: "/* jspsych-socialai, MIT licence, contributors to socialai-dsl. It contains nothing of others. */" };
await build({ ...all, banner, format: "esm", external: ["jspsych"], outfile: join(out, "index.js") });
await build({ ...all, banner, format: "cjs", external: ["jspsych"], outfile: join(out, "index.cjs"), footer: { js: "module.exports = module.exports.default;" } });
await build({ ...all, banner, format: "iife", alias: { jspsych: join(own, "src/browser.js") }, minify: true, outfile: join(out, "index.browser.min.js"), globalName: "jsPsychSocialai", footer: { js: "jsPsychSocialai = jsPsychSocialai.default;" } });

const types = mkdtempSync(join(tmpdir(), "types-"));
execFileSync("npx", ["tsc", "-p", own, "--noEmit", "false", "--declaration", "--emitDeclarationOnly", "--outDir", types]);
copyFileSync(join(types, "web/jspsych-socialai/src/index.d.ts"), join(out, "index.d.ts"));
rmSync(types, { recursive: true });
