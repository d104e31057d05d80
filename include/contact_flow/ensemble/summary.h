// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <map>
#include <string>
#include <utility>
#include <vector>

#include "contact_flow/ensemble/bytes.h"
#include "contact_flow/ensemble/quantile_sketch.h"
#include "contact_flow/types.h"

namespace contact_flow {

/// How one run of an ensemble came out: a value of Outcome, or one of these.
enum RunOutcome : int {
  kInadmissible = -1,  ///< the draw is no start of the model: it penetrates, a mass is negative, …
  kThrew = -2,         ///< the model threw; the message says what
  kNotRun = -3,        ///< the sweep ended before; the row means nothing
};
/// OutcomeName, or "inadmissible", "threw", "not run".
std::string RunOutcomeName(int outcome);

/// A histogram of one observable with bins of equal width: bin k holds the values from its left
/// edge low + k (high − low)/bins on up to the next one's.
struct HistogramAxis {
  int observable = 0;  ///< its index
  double low = 0;      ///< left end of the first bin
  double high = 1;     ///< right end of the last bin
  int bins = 10;       ///< how many
  /// Whether all is the same.
  bool operator==(const HistogramAxis& o) const {
    return observable == o.observable && low == o.low && high == o.high && bins == o.bins;
  }
};

/// What is counted and measured of some runs. Observables y are measured where a run's outcome is
/// kOk, all others are counted.
///   mean ȳ,  M = Σ (y − ȳ)(y − ȳ)ᵀ by Welford's update; two merge by Chan, Golub & LeVeque:
///   ȳ = ȳ_a + δ n_b/n,   M = M_a + M_b + δ δᵀ n_a n_b/n,   δ = ȳ_b − ȳ_a.
struct Summary {
  /// Of so many observables, and with these histograms.
  explicit Summary(int observables = 0, std::vector<HistogramAxis> axes = {});

  /// One run with outcome kOk and these observables [r], with its mode word.
  void AddMeasured(const VectorRef& y, const std::string& word);
  /// One run that came out otherwise, and why.
  void AddUnmeasured(std::uint64_t run, int outcome, const std::string& word,
                     const std::string& message);
  /// Adds another one, of later runs. Throws std::invalid_argument where it measures other things.
  void Merge(const Summary& other);

  /// M/(n − 1) [r×r], NaN where n < 2.
  Matrix Covariance() const;

  /// To bytes and back.
  void Write(ByteWriter* out) const;
  /// Throws std::invalid_argument for what Write did not write.
  static Summary Read(ByteReader* in);

  /// More different words than these are counted as `other_words`, the most frequent being kept.
  static constexpr std::size_t kMaxWords = 4096;

  std::uint64_t runs = 0;                 ///< all
  std::uint64_t measured = 0;             ///< n, those with outcome kOk
  std::map<int, std::uint64_t> outcomes;  ///< counts
  /// The first run with each outcome but kOk, and why it came out so.
  std::map<int, std::pair<std::uint64_t, std::string>> examples;
  std::map<std::string, std::uint64_t> words;  ///< counts of runs by mode word
  std::uint64_t other_words = 0;               ///< counts of rare words, whose names are lost
  Vector mean;                                 ///< ȳ [r]
  Matrix scatter;                              ///< M [r×r], its lower triangle
  Vector smallest;                             ///< of each observable [r], +∞ without runs
  Vector largest;                              ///< of each observable [r], −∞ without runs
  std::vector<QuantileSketch> sketches;        ///< [r]
  std::vector<HistogramAxis> axes;             ///< of the histograms
  /// Of each histogram: below, bins, at or above [bins+2].
  std::vector<std::vector<std::uint64_t>> histograms;

 private:
  void LimitWords();
};

}  // namespace contact_flow
