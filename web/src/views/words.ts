/** Words that several views have for the same thing. */
import type { Connection } from "../model/model.ts";

/** A line at 115 200 baud carries this many bytes a second, each way. */
export const LINE_BYTES_PER_SECOND = 11_520;
export function connectionWords(connection: Connection): { text: string; detail: string } {
  switch (connection.state) {
    case "none":
      return { text: "○ not connected", detail: "No base is connected" };
    case "connecting":
      return { text: "◌ connecting", detail: `Connecting to ${connection.to}` };
    case "lost":
      return { text: "✕ connection lost", detail: `${connection.to}: ${connection.why}` };
    case "log":
      return { text: "▤ log", detail: connection.name };
    case "open":
      return connection.role === "drive"
        ? { text: "● connected, drives", detail: `This page drives ${connection.to}` }
        : { text: "◉ connected, watches", detail: `This page watches ${connection.to}: it sends nothing` };
  }
}
