// SPDX-License-Identifier: Apache-2.0
import { kMillisecond, latest, type Nanoseconds } from "./time.js";

/**
 * Round-trip time and retransmission timeout (RFC 6298):
 *
 *     first sample R:  SRTT = R, RTTVAR = R/2
 *     then:            RTTVAR += (|SRTT − R| − RTTVAR)/4,  SRTT += (R − SRTT)/8
 *     timeout:         max(minimum, SRTT + 4 RTTVAR)
 */
export class RoundTrip {
  /** Timeout before the first sample. */
  static readonly kFirstTimeout = 100n * kMillisecond;

  newest: Nanoseconds | undefined;
  smoothed: Nanoseconds = 0n;
  variation: Nanoseconds = 0n;

  observe(sample: Nanoseconds): void {
    if (this.newest === undefined) {
      this.smoothed = sample;
      this.variation = sample / 2n;
    } else {
      const error = sample - this.smoothed;
      this.variation += ((error < 0n ? -error : error) - this.variation) / 4n;
      this.smoothed += error / 8n;
    }
    this.newest = sample;
  }

  timeout(minimum: Nanoseconds): Nanoseconds {
    return latest(minimum, this.newest === undefined ? RoundTrip.kFirstTimeout : this.smoothed + 4n * this.variation);
  }
}
