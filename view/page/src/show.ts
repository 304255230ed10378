// Numbers, units, times and formulas as a chemist writes them.

const UP: Record<string, string> = { "0": "⁰", "1": "¹", "2": "²", "3": "³", "4": "⁴", "5": "⁵", "6": "⁶", "7": "⁷", "8": "⁸", "9": "⁹", "+": "⁺", "-": "⁻" };
const DOWN = "₀₁₂₃₄₅₆₇₈₉";

const raise = (text: string) => [...text].map((c) => UP[c] ?? c).join("");
const lower = (text: string) => text.replace(/\d/g, (d) => DOWN[Number(d)]!);

export function unit(symbol: string): string {
    return symbol
        .replace(/\bdegC\b/g, "°C")
        .replace(/\bdeg\b/g, "°")
        .replace(/\bu(?=[LgmsMNA]|mol)/g, "µ")
        .replace(/\^(-?\d+)/g, (_, digits: string) => raise(digits))
        .replace(/\*/g, "·");
}

/** Four significant digits. */
export function number(value: number | null): string {
    if (value === null) return "–";
    if (value === 0) return "0";
    const size = Math.abs(value);
    if (size < 1e-4 || size >= 1e6) {
        const [digits, power] = value.toExponential(2).split("e") as [string, string];
        return `${Number(digits)}·10${raise(power.replace("+", ""))}`.replace("-", "−");
    }
    return String(Number(value.toPrecision(4))).replace("-", "−");
}

export function quantity(value: number | null, symbol: string): string {
    return symbol === "" || value === null ? number(value) : `${number(value)} ${unit(symbol)}`;
}

/** `H2O2` with its digits below, `SO4^2-` with its charge above; anything else as it is. */
export function species(name: string): string {
    const parts = /^((?:[A-Z][a-z]?\d*|\((?:[A-Z][a-z]?\d*)+\)\d*)+)(?:\^?(\d*[+-]))?(\([a-z]+\))?$/.exec(name);
    if (!parts) return name;
    return lower(parts[1]!) + raise(parts[2] ?? "") + (parts[3] ?? "");
}

/** `4:41`, `1:02:03`; with tenths below a minute in all. */
export function clock(time: number, duration: number): string {
    const tenths = duration < 60 ? 1 : 0;
    const whole = Math.floor(time * 10 ** tenths + 1e-6) / 10 ** tenths;
    const seconds = (whole % 60).toFixed(tenths).padStart(tenths ? 4 : 2, "0");
    const minutes = Math.floor(whole / 60) % 60;
    const hours = Math.floor(whole / 3600);
    return hours > 0 ? `${hours}:${String(minutes).padStart(2, "0")}:${seconds}` : `${minutes}:${seconds}`;
}

/** The last part of a path. */
export function file(name: string): string {
    return name.split(/[\\/]/).pop() ?? name;
}

export function element<K extends keyof HTMLElementTagNameMap>(
    tag: K,
    className = "",
    ...children: (globalThis.Node | string)[]
): HTMLElementTagNameMap[K] {
    const made = document.createElement(tag);
    if (className) made.className = className;
    made.append(...children);
    return made;
}

/** Sets a text only if it is another one, so that the browser has nothing to do if it is not. */
export function put(target: Element, text: string): void {
    if (target.textContent !== text) target.textContent = text;
}
