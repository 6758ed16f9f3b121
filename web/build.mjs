// Build of the page: run `npm ci && npm run build` in web/. The first line of the built script has a digest of the sources,
// by which a test checks that it was built from them.
import { createHash } from "node:crypto";
import { copyFileSync, readFileSync, readdirSync } from "node:fs";
import { build } from "esbuild";

const PAGE = "../src/drone_sim/ros/cockpit/page"; // the folder that the cockpit serves

function digest() {
  const names = readdirSync("src", { recursive: true }).map((name) => name.replaceAll("\\", "/"));
  const scripts = names.filter((name) => name.endsWith(".js")).sort();
  const hash = createHash("sha256");
  for (const file of [...scripts.map((name) => `src/${name}`), "package-lock.json"]) hash.update(`${file}\n`).update(readFileSync(file));
  return hash.digest("hex");
}

await build({
  entryPoints: ["src/cockpit.js"],
  outfile: `${PAGE}/cockpit.js`,
  bundle: true,
  minify: true,
  target: "es2020",
  charset: "utf8", // the charset that the server sends
  tsconfigRaw: {}, // ignores tsconfig.json, whose `strict` is for the type check only
  banner: { js: `// built from web/src, sha256 ${digest()}` },
});
for (const name of readdirSync("src").filter((one) => /\.(html|css)$/.test(one))) copyFileSync(`src/${name}`, `${PAGE}/${name}`);
copyFileSync("../src/drone_sim/grading/outputs/html/files/card.css", `${PAGE}/card.css`); // the styles of the report
copyFileSync("node_modules/uplot/dist/uPlot.min.css", `${PAGE}/uPlot.min.css`);
