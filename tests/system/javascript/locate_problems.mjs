// Finds the fields that messages are about with the function of the page, and prints the paths as JSON:
//   node locate_problems.mjs METHOD_PROBLEMS.js < [{"message", "method"}]

import { readFileSync } from "node:fs";

// Read as text, because a file without a package beside it has no type of module in older versions of Node.
const source = readFileSync(process.argv[2], "utf8");
const { locateProblem } = await import(`data:text/javascript,${encodeURIComponent(source)}`);
console.log(JSON.stringify(JSON.parse(readFileSync(0, "utf8")).map(({ message, method }) => locateProblem(message, method))));
