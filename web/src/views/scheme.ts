/** Light or dark: as the system has it, unless the user says otherwise. What is in force is the attribute data-theme of the root element. */
import { keep, recall } from "./storage.ts";

const CHOICES = ["system", "light", "dark"] as const;
type Choice = (typeof CHOICES)[number];
const LABELS: Readonly<Record<Choice, string>> = { system: "◐ System", light: "○ Light", dark: "● Dark" };

export function scheme(target: Window) {
  const dark = target.matchMedia("(prefers-color-scheme: dark)");
  let choice = CHOICES.find((each) => each === recall("localStorage", "scheme")) ?? "system";
  const apply = () => {
    const inForce = choice === "system" ? (dark.matches ? "dark" : "light") : choice;
    target.document.documentElement.dataset.theme = inForce;
  };
  dark.addEventListener("change", apply);
  apply();
  return {
    label: () => LABELS[choice],
    next: () => {
      choice = CHOICES[(CHOICES.indexOf(choice) + 1) % CHOICES.length] ?? "system";
      keep("localStorage", "scheme", choice);
      apply();
    },
  };
}
