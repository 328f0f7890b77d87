// Compile the Python files of a folder to bytecode of Pyodide's Python, and pack them: node compile.mjs PYODIDE IN OUT.zip
// A browser would compile 600 files at each start of the page, which takes it seconds.

import { readFileSync, writeFileSync } from "node:fs";
import { resolve } from "node:path";
import { pathToFileURL } from "node:url";

const [home, from, to] = process.argv.slice(2).map((path) => resolve(path));
const { loadPyodide } = await import(pathToFileURL(`${home}/pyodide.mjs`).href);
const python = await loadPyodide({ indexURL: `${home}/` });
python.unpackArchive(new Uint8Array(readFileSync(from)), "zip", { extractDir: "/live" });
python.runPython(`
import compileall, pathlib, py_compile, zipfile
compileall.compile_dir("/live", quiet=1, legacy=True, invalidation_mode=py_compile.PycInvalidationMode.UNCHECKED_HASH)
with zipfile.ZipFile("/packed.zip", "w", zipfile.ZIP_DEFLATED, compresslevel=9) as packed:
    for file in sorted(pathlib.Path("/live").rglob("*")):
        if file.is_file() and not (file.suffix == ".py" and file.with_suffix(".pyc").exists()):
            packed.writestr(zipfile.ZipInfo(str(file.relative_to("/live"))), file.read_bytes(), zipfile.ZIP_DEFLATED, 9)
`);
writeFileSync(to, python.FS.readFile("/packed.zip"));
