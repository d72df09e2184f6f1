// The paper's claims: a row each, grouped by experiment, the verdicts for both settings side by side.

// Instead of a verdict, where no run could show it.
const NOTHING = "nothing to judge";
const VERDICTS = {
  reproduced: ["good", "✓"],
  partly: ["fair", "~"],
  "not reproduced": ["bad", "✕"],
  [NOTHING]: ["unknown", "–"],
};
// How the settings are called; claims that depend on none of them have null.
const SETTINGS = [
  ["recommended", "Recommended settings"],
  ["paper", "The paper's settings"],
];

function verdictOf(claim) {
  return claim.judged || known(claim.fraction) ? claim.verdict : NOTHING;
}

function verdictBadge(verdict, words = verdict) {
  const [kind, sign] = VERDICTS[verdict] ?? ["unknown", "?"];
  return badge(kind, sign, words);
}

// In how many of the judged runs a claim holds.
function holdsIn(claim) {
  if (!claim.judged) return known(claim.fraction) ? percent(claim.fraction) : "";
  return `${Math.round((claim.fraction ?? 0) * claim.judged)} of ${claim.judged}`;
}

// Claims of one group, a row each: [{claim, both, recommended, paper}].
function claimRows(claims) {
  const rows = new Map();
  for (const claim of claims) {
    const id = claim.settings === "paper" ? claim.id.replace(/-paper$/, "") : claim.id;
    const row = rows.get(id) ?? {};
    row[claim.settings ?? "both"] = claim;
    rows.set(id, row);
  }
  return [...rows.values()].map((row) => ({ ...row, claim: row.both ?? row.recommended ?? row.paper }));
}

// What unfolds: our numbers, why, and the run that isolates it.
function claimDetails(claim, heading) {
  const link = claim.reason?.run;
  const scene = link && report.scenes.find(({ name }) => name === link.scene);
  const there = scene?.runs.some(({ label }) => label === link.label);
  const seeds = claim.seeds.length;
  return el("div", { class: "claim-details" },
    heading ? el("h4", {}, heading) : null,
    el("p", {}, prose(claim.ours), seeds ? el("span", { class: "soft" }, ` (${seeds} recording seed${seeds === 1 ? "" : "s"})`) : null),
    claim.reason ? el("p", {}, el("b", {}, "Why: "), prose(claim.reason.text),
      there ? [" ", el("button", { type: "button", class: "link", onclick: () => showRun(link.scene, link.label) }, `Show ${link.label}`)] : null) : null);
}

function claimRow(row) {
  const cell = (key, words) => {
    const claim = row[key];
    // Where there are no columns, words say whose settings they are.
    return el("span", { class: "verdict" }, el("span", { class: "verdict-of" }, `${words}: `),
      claim ? [verdictBadge(verdictOf(claim)), " ", el("span", { class: "holds" }, holdsIn(claim))] : NONE);
  };
  const verdicts = row.both
    ? el("span", { class: "verdict verdict-both" }, verdictBadge(verdictOf(row.both)), " ", el("span", { class: "holds" }, holdsIn(row.both)))
    : SETTINGS.map(([key, words]) => cell(key, words));
  const details = row.both ? claimDetails(row.both)
    : SETTINGS.filter(([key]) => row[key]).map(([key, words]) => claimDetails(row[key], words));
  return el("details", { class: "claim" },
    el("summary", {}, el("span", { class: "claim-text" }, prose(row.claim.claim)),
      el("span", { class: "claim-paper" }, el("span", { class: "claim-paper-of" }, "Paper: "), prose(row.claim.paper)), verdicts),
    el("div", { class: "claim-more" }, details));
}

// How many of which verdict, a line for each of the settings.
function claimCounts() {
  const line = (key, words) => {
    const claims = report.claims.filter((claim) => (claim.settings ?? null) === key);
    const counts = Object.keys(VERDICTS).map((verdict) => [verdict, claims.filter((claim) => verdictOf(claim) === verdict).length]);
    return claims.length ? [el("dt", {}, words), el("dd", {}, counts.filter(([, n]) => n > 0).map(([verdict, n]) =>
      [verdictBadge(verdict, `${n} ${verdict}`), " "]))] : null;
  };
  const neither = report.claims.some((claim) => claim.settings) ? "Independent of settings" : "Claims";
  return el("dl", { class: "claim-counts" }, SETTINGS.map(([key, words]) => line(key, words)), line(null, neither));
}

function claimsPart() {
  if (!report.claims.length) return null;
  const groups = [...new Set(report.claims.map((claim) => claim.group))];
  const rows = groups.map((group) => [group ? el("h3", {}, group) : null,
    claimRows(report.claims.filter((claim) => claim.group === group)).map(claimRow)]);
  const box = el("div", { class: "claims" },
    el("div", { class: "claim-columns", "aria-hidden": "true" }, el("span", {}, "Claim"), el("span", {}, "The paper shows"),
      SETTINGS.map(([, words]) => el("span", {}, words))), rows);
  const all = [...box.querySelectorAll("details")];
  const unfold = el("button", { type: "button", class: "small unfold", onclick: () => {
    const open = !all.every((one) => one.open);
    for (const one of all) one.open = open;
  } }, "Unfold all");
  const words = () => (unfold.textContent = all.every((one) => one.open) ? "Fold all" : "Unfold all");
  for (const one of all) one.addEventListener("toggle", words);
  return part("claims", "Claim by claim", claimCounts(),
    el("p", { class: "soft" }, "A claim is reproduced if it holds in at least 80 % of the judged runs, partly in 20 to 80 %. A row unfolds to our numbers and, where a run isolates it, the reason. ",
      unfold), box);
}

