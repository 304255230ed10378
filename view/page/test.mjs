// Opens pages in a headless browser as a reader would: plays, scrubs, selects, changes the theme; no error may be
// logged, nothing may be fetched. Takes pictures. `node test.mjs FOLDER PAGE.html...`

import { access, mkdir } from "node:fs/promises";
import { basename, join, resolve } from "node:path";
import { pathToFileURL } from "node:url";
import { chromium } from "playwright-core";

const [folder, ...pages] = process.argv.slice(2);
const flags = [
    "--no-sandbox", "--disable-gpu", "--enable-unsafe-swiftshader", "--disable-quic", "--no-first-run",
    "--disable-background-networking", "--disable-component-update", "--disable-sync",
];
const executablePath = process.env.CHROMIUM ?? "/usr/bin/chromium";
await access(executablePath);
await mkdir(folder, { recursive: true });
const browser = await chromium.launch({ executablePath, headless: true, args: flags });
let [passed, failed] = [0, 0];

function check(holds, what) {
    if (holds) passed++;
    else {
        failed++;
        console.error(`failed: ${what}`);
    }
}

for (const file of pages) {
    const name = basename(file, ".html");
    const page = await browser.newPage({ viewport: { width: 1440, height: 900 }, colorScheme: "light" });
    const errors = [];
    page.on("console", (message) => {
        // The software renderer of a headless browser says how slow it is; that is not the page's doing.
        if (["error", "warning"].includes(message.type()) && !/GPU stall|GL Driver Message|software WebGL/i.test(message.text())) errors.push(message.text());
    });
    page.on("pageerror", (error) => errors.push(String(error)));
    page.on("request", (request) => {
        if (!/^(file|data|blob):/.test(request.url())) errors.push(`fetches ${request.url()}`);
    });
    const picture = (part) => page.screenshot({ path: join(folder, `${name}-${part}.png`) });
    await page.goto(pathToFileURL(resolve(file)).href);
    await page.waitForSelector("html.ready", { timeout: 30000 });
    await page.waitForTimeout(1200);
    await picture("start");
    const played = await page.evaluate(() => !document.documentElement.classList.contains("unplayed"));
    if (played) {
        const time = () => page.textContent("#time");
        await page.keyboard.press("Space");
        const began = await time();
        const moved = await page.waitForFunction((from) => document.getElementById("time").textContent !== from, began, { timeout: 20000 }).catch(() => null);
        check(moved !== null, `${name}: plays`);
        await page.keyboard.press("Space");
        const line = await page.locator(".area").boundingBox();
        for (const part of [0.25, 0.55, 0.85]) {
            await page.mouse.click(line.x + part * line.width, line.y + 8);
            await page.waitForTimeout(700);
            await picture(`at-${Math.round(part * 100)}`);
        }
        await page.keyboard.press("End");
        check((await page.textContent("#time")) === (await page.textContent("#duration")), `${name}: goes to the end`);
        await page.keyboard.press("Home");
        check(/^0:00/.test(await time()), `${name}: goes to the start`);
        const later = page.locator("#plan .line:visible").nth(1);
        if ((await later.count()) > 0) await later.click();
        await page.mouse.click(line.x + 0.6 * line.width, line.y + 8);
        check((await page.locator("#plots canvas").count()) > 0, `${name}: plots`);
        await page.keyboard.press("2");
        await page.waitForTimeout(300);
        check((await page.locator("#source .row").count()) > 0, `${name}: shows the program`);
        await picture("program");
        await page.keyboard.press("3");
    }
    const vessel = page.locator("#things .vessel, #things .map .spot").first();
    if ((await vessel.count()) > 0) {
        await vessel.click();
        await page.waitForTimeout(500);
        check((await page.locator("#things .table .row").count()) > 0, `${name}: says what is in a vessel`);
    }
    await page.keyboard.press("t");
    await page.waitForTimeout(700);
    await picture("dark");
    await page.keyboard.press("Escape");
    await page.keyboard.press("?");
    await page.waitForTimeout(300);
    check(await page.locator("#help").isVisible(), `${name}: helps`);
    await page.keyboard.press("Escape");
    check(errors.length === 0, `${name}: ${errors.join("; ")}`);
    await page.close();
}
await browser.close();
console.log(`${passed} passed, ${failed} failed`);
process.exit(failed ? 1 : 0);
