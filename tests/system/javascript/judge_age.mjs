// Age of stamps on a controlled clock; prints the ages as JSON: node judge_age.mjs PATH_OF_SERVICE_CLOCK

import { pathToFileURL } from "node:url";

const { ServiceClock } = await import(pathToFileURL(process.argv[2]));
let now = 100;
const clock = new ServiceClock(() => now);
const ages = { before: clock.age(5000) === Infinity };

clock.update(5000); // UTC 5000 s at 100 s of this device
ages.fresh = clock.age(5000);
now = 133;
ages.silent = clock.age(5000);
clock.update(5001); // a message that waited 32 s in a socket is old when it arrives
ages.waited = clock.age(5001);
clock.update(5033.2); // a message with a shorter way
ages.shorter = clock.age(5001);
now = 134;
clock.update(5034.1);
ages.present = clock.age(5034.1);
console.log(JSON.stringify(ages));
