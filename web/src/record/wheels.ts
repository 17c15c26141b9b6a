/** What a log of counts is integrated with. */

/** The wheels that the counts are of. */
export interface Wheels {
  readonly wheelBase: number;
  readonly leftDiameter: number;
  readonly rightDiameter: number;
  readonly countsPerTurn: number;
  /** Whose they are, in words. */
  readonly origin: string;
}
