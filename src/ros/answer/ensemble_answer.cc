// SPDX-License-Identifier: BSD-3-Clause
#include "ensemble_answer.h"

#include <algorithm>
#include <chrono>
#include <string>
#include <utility>
#include <vector>

#include "contact_flow/SweepEnsembleResult.h"
#include "contact_flow/budget.h"
#include "src/ros/message/conversions.h"
#include "src/ros/message/gate.h"
#include "src/ros/request/analysis_messages.h"
#include "src/ros/request/ensemble_problem.h"

namespace contact_flow {
namespace ros_interface {
namespace {

constexpr double kPartSeconds = 1;  // what is lost at most where time ends a sweep
using Clock = std::chrono::steady_clock;

template <class T>
void Append(std::vector<T>&& from, std::vector<T>* to) {
  to->insert(to->end(), std::make_move_iterator(from.begin()), std::make_move_iterator(from.end()));
}

/// The columns of the runs behind those that are there.
void Append(Columns&& columns, EnsembleResult* result) {
  Append(std::move(columns.outcome), &result->run_outcome);
  Append(std::move(columns.num_events), &result->num_events);
  Append(std::move(columns.derivative_outcome), &result->derivative_outcome);
  Append(std::move(columns.words), &result->run_words);
  result->columns.resize(columns.reals.size());
  for (std::size_t k = 0; k < columns.reals.size(); ++k) {
    EnsembleColumn& column = result->columns[k];
    column.name = columns.reals[k].name;
    column.shape.assign(columns.reals[k].shape.begin(), columns.reals[k].shape.end());
    Append(std::move(columns.reals[k].values), &column.values);
  }
}

std::vector<EnsembleCount> WordCounts(const Summary& summary) {
  std::vector<EnsembleCount> counts;
  for (const auto& [word, count] : summary.words) {
    counts.emplace_back();
    counts.back().name = word;
    counts.back().count = count;
  }
  std::stable_sort(counts.begin(), counts.end(),
                   [](const auto& a, const auto& b) { return a.count > b.count; });
  return counts;
}

void WriteSummary(const Summary& summary, const EnsembleRequest& request,
                  const std::vector<double>& probabilities, EnsembleResult* result) {
  result->runs = summary.runs;
  result->measured = summary.measured;
  result->outcomes = ToMsg(summary.outcomes);
  for (EnsembleCount& outcome : result->outcomes) {
    for (const auto& [code, example] : summary.examples) {
      if (outcome.name != RunOutcomeName(code)) continue;
      outcome.first = example.first;
      outcome.message = example.second;
    }
  }
  result->words = WordCounts(summary);
  result->other_words = summary.other_words;
  result->mean = ToMsg(VectorRef(summary.mean));
  result->covariance = ToMsg(MatrixRef(summary.Covariance()));
  result->smallest = ToMsg(VectorRef(summary.smallest));
  result->largest = ToMsg(VectorRef(summary.largest));
  result->probabilities = probabilities;
  const auto r = static_cast<Eigen::Index>(summary.sketches.size());
  Matrix quantiles(static_cast<Eigen::Index>(probabilities.size()), r);
  for (Eigen::Index k = 0; k < r; ++k) {
    const QuantileSketch& sketch = summary.sketches[static_cast<std::size_t>(k)];
    for (Eigen::Index i = 0; i < quantiles.rows(); ++i) {
      quantiles(i, k) = sketch.Quantile(probabilities[static_cast<std::size_t>(i)]);
    }
    const auto count = static_cast<double>(std::max(sketch.count(), std::uint64_t{1}));
    result->rank_error.push_back(static_cast<double>(sketch.RankError()) / count);
  }
  result->quantiles = ToMsg(MatrixRef(quantiles));
  for (std::size_t k = 0; k < summary.histograms.size(); ++k) {
    result->histograms.emplace_back();
    result->histograms.back().axis = request.histograms[k];
    result->histograms.back().counts = summary.histograms[k];
  }
}

/// A sweep part by part, each counted as a whole or not at all: what is counted is always the runs
/// before some number.
class Parts {
 public:
  Parts(SweepRequest sweep, const Watch& watch)
      : sweep_(std::move(sweep)), watch_(watch), total_(sweep_.count) {
    sweep_.progress = [this](const SweepProgress& progress) { Report(progress); };
  }

  /// Runs them until all are done or the budget of the thread ends. Returns how that came.
  Status Run(EnsembleResult* result) {
    std::uint64_t blocks = static_cast<std::uint64_t>(sweep_.threads);
    for (sweep_.first = 0; sweep_.first < total_;) {
      sweep_.count = std::min(total_ - sweep_.first, blocks * Tally::kBlock);
      SweepResult part;
      try {
        part = Sweep(sweep_);
      } catch (const BudgetExceeded& reason) {
        if (sweep_.first == 0) throw;
        return {OutcomeOf(reason), reason.what()};
      }
      if (!part.status.ok()) return part.status;
      tally_.Merge(part.tally);
      for (const auto& [outcome, count] : part.progress.outcomes) outcomes_[outcome] += count;
      reference_ = part.reference;
      Append(std::move(part.columns), result);
      sweep_.first += sweep_.count;
      const double again = kPartSeconds * part.progress.rate / Tally::kBlock / sweep_.threads;
      blocks = static_cast<std::uint64_t>(std::max(1.0, std::min(again, 1e6)) * sweep_.threads);
    }
    return {};
  }

  const Tally& tally() const { return tally_; }
  const Vector& reference() const { return reference_; }

 private:
  /// Of one part as of all.
  void Report(const SweepProgress& part) const {
    if (!watch_.report_sweep) return;
    SweepProgress all;
    all.done = sweep_.first + part.done;
    all.total = total_;
    all.elapsed = std::chrono::duration<double>(Clock::now() - begin_).count();
    all.rate = static_cast<double>(all.done) / std::max(all.elapsed, 1e-9);
    const std::uint64_t left = total_ - all.done;
    all.left = left == 0 ? 0 : static_cast<double>(left) / all.rate;
    all.outcomes = outcomes_;
    for (const auto& [outcome, count] : part.outcomes) all.outcomes[outcome] += count;
    watch_.report_sweep(all);
  }

  SweepRequest sweep_;
  const Watch& watch_;
  const std::uint64_t total_;
  const Clock::time_point begin_ = Clock::now();
  Tally tally_;
  Vector reference_;
  std::map<int, std::uint64_t> outcomes_;
};

}  // namespace

std::vector<EnsembleCount> ToMsg(const std::map<int, std::uint64_t>& outcomes) {
  std::vector<EnsembleCount> counts;
  for (const auto& [outcome, count] : outcomes) {
    counts.emplace_back();
    counts.back().name = RunOutcomeName(outcome);
    counts.back().count = count;
  }
  return counts;
}

EnsembleResult Answer(const Setup& setup, const EnsembleRequest& request, const Watch& watch) {
  CheckMessage(request);
  const MechanicalSystem& system = *setup.system;
  SweepRequest sweep = ResolveEnsemble(setup, request);
  const std::vector<double> probabilities = ResolveProbabilities(request);
  EnsembleResult result;
  result.model = system.description().name;
  const std::vector<std::string> drawn = Sampler(sweep.draws).names();
  if (sweep.keep.start) result.start_names = drawn;
  result.observables = ObservableNames(system, sweep.keep);
  AskBudget();  // a place among the long requests comes before threads of its own
  const double bytes =
      Recorder(system, sweep.keep, drawn, sweep.inputs.grid.front(), sweep.duration).BytesPerRun();
  AskMemory(bytes * static_cast<double>(sweep.count),
            "the columns of " + std::to_string(sweep.count) + " runs");
  AskMemory(StatisticsBytes(sweep, sweep.threads),
            "the statistics of " + std::to_string(sweep.count) + " runs");
  Parts parts(std::move(sweep), watch);
  const Status status = parts.Run(&result);
  if (!status.ok()) {
    result.outcome = EndOfSearch();
    result.message = status.message;
  }
  if (parts.reference().size() == 0) return result;  // nothing is counted
  result.reference_q = ToMsg(VectorRef(parts.reference().head(system.num_positions())));
  result.reference_v = ToMsg(VectorRef(parts.reference().tail(system.dof())));
  WriteSummary(parts.tally().Total(), request, probabilities, &result);
  return result;
}

static_assert(SweepEnsembleResult::CANCELLED == kAnalysisCancelled,
              "the constants of the action are those of analyses");

}  // namespace ros_interface
}  // namespace contact_flow
