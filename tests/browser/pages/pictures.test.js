// Pages look as they are stored, at three widths in both themes.

import assert from "node:assert/strict";
import { after, before, test } from "node:test";

import { opened } from "../browser.js";
import { assertLooksAsStored, launchedForPictures, THEMES, WIDTHS } from "../pictures.js";

let browser;
before(async () => { browser = await launchedForPictures(); });
after(() => browser.close());

for (const name of ["known", "hostile"]) {
  for (const width of WIDTHS) {
    for (const theme of THEMES) {
      test(`${name}.html looks as stored at ${width} px, ${theme}`, async () => {
        const { page, close } = await opened(browser, `${name}.html`, { width, theme, touch: width === 390 });
        await assertLooksAsStored(page, `pages/${name}-${width}-${theme}`);
        await close();
      });
    }
  }
}

/** Adds rules of style, which the policy of the page would refuse as an element. */
const styled = (page, rules) =>
  page.evaluate((rules) => {
    const sheet = new CSSStyleSheet();
    sheet.replaceSync(rules);
    document.adoptedStyleSheets = [sheet];
  }, rules);

const DEFECTS = {
  "a caption that is missing": "#figure-position .caption { visibility: hidden }",
  "a legend that moved by 12 px": ".legend { position: relative; left: 12px }",
  "a wrong colour": ".cards .value { color: #a33 }",
};

for (const [what, style] of Object.entries(DEFECTS)) {
  test(`${what} is found`, async () => {
    const { page, close } = await opened(browser, "known.html");
    await styled(page, style);
    await assert.rejects(assertLooksAsStored(page, "pages/known-1280-light"), /of 64 blocks differ/);
    await close();
  });
}

test("text that another rasteriser draws half a pixel further is none", async () => {
  const { page, close } = await opened(browser, "known.html");
  await styled(page, "main { transform: translateX(0.5px) }");
  await assertLooksAsStored(page, "pages/known-1280-light");
  await close();
});
