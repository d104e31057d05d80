// SPDX-License-Identifier: BSD-3-Clause
#include "contact_flow/ensemble/summary.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <stdexcept>

#include "contact_flow/flow/status.h"

namespace contact_flow {
namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();
constexpr int kMaxObservables = 100000;

std::size_t BinOf(const HistogramAxis& axis, double value) {
  if (value < axis.low) return 0;
  if (!(value < axis.high)) return static_cast<std::size_t>(axis.bins) + 1;
  // The quotient may round to the neighbour of the bin that has the value between its edges.
  const double width = (axis.high - axis.low) / axis.bins;
  auto bin = static_cast<int>(std::min((value - axis.low) / width, axis.bins - 1.0));
  if (bin > 0 && value < axis.low + bin * width) --bin;
  if (bin + 1 < axis.bins && value >= axis.low + (bin + 1) * width) ++bin;
  return 1 + static_cast<std::size_t>(bin);
}

void Put(const Vector& v, ByteWriter* out) {
  out->Put(std::vector<double>(v.data(), v.data() + v.size()));
}

Vector GetVector(Eigen::Index size, ByteReader* in) {
  const std::vector<double> values = in->GetVector<double>();
  if (static_cast<Eigen::Index>(values.size()) != size) ByteReader::Refuse();
  return Eigen::Map<const Vector>(values.data(), size);
}

}  // namespace

std::string RunOutcomeName(int outcome) {
  if (outcome == kInadmissible) return "inadmissible";
  if (outcome == kThrew) return "threw";
  if (outcome == kNotRun) return "not run";
  return OutcomeName(static_cast<Outcome>(outcome));
}

Summary::Summary(int observables, std::vector<HistogramAxis> histogram_axes)
    : mean(Vector::Zero(observables)),
      scatter(Matrix::Zero(observables, observables)),
      smallest(Vector::Constant(observables, kInfinity)),
      largest(Vector::Constant(observables, -kInfinity)),
      sketches(static_cast<std::size_t>(observables)),
      axes(std::move(histogram_axes)) {
  for (const HistogramAxis& axis : axes) {
    if (axis.observable < 0 || axis.observable >= observables || axis.bins < 1 ||
        axis.bins > 1000000 || !(axis.low < axis.high) || !std::isfinite(axis.high - axis.low)) {
      throw std::invalid_argument(
          "a histogram needs finite low < high and 1 to 1000000 bins of an observable");
    }
    histograms.emplace_back(static_cast<std::size_t>(axis.bins) + 2, 0);
  }
}

void Summary::AddMeasured(const VectorRef& y, const std::string& word) {
  ++runs;
  ++measured;
  ++outcomes[0];
  ++words[word];
  const Vector before = y - mean;
  mean += before / static_cast<double>(measured);
  const Vector after = y - mean;
  for (Eigen::Index j = 0; j < y.size(); ++j) {
    scatter.col(j).tail(y.size() - j) += after(j) * before.tail(y.size() - j);
  }
  smallest = smallest.cwiseMin(y);
  largest = largest.cwiseMax(y);
  for (std::size_t k = 0; k < sketches.size(); ++k) {
    sketches[k].Add(y(static_cast<Eigen::Index>(k)));
  }
  for (std::size_t k = 0; k < axes.size(); ++k) {
    ++histograms[k][BinOf(axes[k], y(axes[k].observable))];
  }
  LimitWords();
}

void Summary::AddUnmeasured(std::uint64_t run, int outcome, const std::string& word,
                            const std::string& message) {
  ++runs;
  ++outcomes[outcome];
  if (!word.empty()) ++words[word];
  examples.emplace(outcome, std::make_pair(run, message));
  LimitWords();
}

void Summary::Merge(const Summary& other) {
  if (mean.size() != other.mean.size() || !(axes == other.axes)) {
    throw std::invalid_argument("the summaries are of different observables or histograms");
  }
  runs += other.runs;
  for (const auto& [outcome, count] : other.outcomes) outcomes[outcome] += count;
  for (const auto& [outcome, example] : other.examples) {
    const auto [it, added] = examples.emplace(outcome, example);
    if (!added && example.first < it->second.first) it->second = example;
  }
  for (const auto& [word, count] : other.words) words[word] += count;
  other_words += other.other_words;
  LimitWords();
  if (other.measured > 0) {
    const auto a = static_cast<double>(measured), b = static_cast<double>(other.measured);
    const Vector delta = other.mean - mean;
    mean += delta * (b / (a + b));
    scatter += other.scatter;
    for (Eigen::Index j = 0; j < delta.size(); ++j) {
      scatter.col(j).tail(delta.size() - j) +=
          (delta(j) * (a * b / (a + b))) * delta.tail(delta.size() - j);
    }
    measured += other.measured;
  }
  smallest = smallest.cwiseMin(other.smallest);
  largest = largest.cwiseMax(other.largest);
  for (std::size_t k = 0; k < sketches.size(); ++k) sketches[k].Merge(other.sketches[k]);
  for (std::size_t k = 0; k < histograms.size(); ++k) {
    for (std::size_t bin = 0; bin < histograms[k].size(); ++bin) {
      histograms[k][bin] += other.histograms[k][bin];
    }
  }
}

void Summary::LimitWords() {
  if (words.size() <= kMaxWords) return;
  std::vector<std::pair<std::uint64_t, std::string>> sorted;
  for (const auto& [word, count] : words) sorted.emplace_back(count, word);
  std::sort(sorted.begin(), sorted.end(), [](const auto& a, const auto& b) {
    return a.first != b.first ? a.first > b.first : a.second < b.second;
  });
  for (std::size_t k = kMaxWords; k < sorted.size(); ++k) {
    other_words += sorted[k].first;
    words.erase(sorted[k].second);
  }
}

Matrix Summary::Covariance() const {
  const Matrix full = scatter.selfadjointView<Eigen::Lower>();
  if (measured < 2) {
    return Matrix::Constant(full.rows(), full.cols(), std::numeric_limits<double>::quiet_NaN());
  }
  return full / static_cast<double>(measured - 1);
}

void Summary::Write(ByteWriter* out) const {
  out->Put(static_cast<std::int64_t>(mean.size()));
  out->Put(static_cast<std::uint64_t>(axes.size()));
  for (const HistogramAxis& axis : axes) {
    out->Put(static_cast<std::int64_t>(axis.observable));
    out->Put(axis.low);
    out->Put(axis.high);
    out->Put(static_cast<std::int64_t>(axis.bins));
  }
  out->Put(runs);
  out->Put(measured);
  out->Put(static_cast<std::uint64_t>(outcomes.size()));
  for (const auto& [outcome, count] : outcomes) {
    out->Put(static_cast<std::int64_t>(outcome));
    out->Put(count);
  }
  out->Put(static_cast<std::uint64_t>(examples.size()));
  for (const auto& [outcome, example] : examples) {
    out->Put(static_cast<std::int64_t>(outcome));
    out->Put(example.first);
    out->Put(example.second);
  }
  out->Put(static_cast<std::uint64_t>(words.size()));
  for (const auto& [word, count] : words) {
    out->Put(word);
    out->Put(count);
  }
  out->Put(other_words);
  Put(mean, out);
  Put(Eigen::Map<const Vector>(scatter.data(), scatter.size()), out);
  Put(smallest, out);
  Put(largest, out);
  for (const QuantileSketch& sketch : sketches) sketch.Write(out);
  for (const auto& histogram : histograms) out->Put(histogram);
}

Summary Summary::Read(ByteReader* in) {
  const auto r = in->Get<std::int64_t>();
  if (r < 0 || r > kMaxObservables) ByteReader::Refuse();
  std::vector<HistogramAxis> axes(in->GetSize(32));
  for (HistogramAxis& axis : axes) {
    axis.observable = static_cast<int>(in->Get<std::int64_t>());
    axis.low = in->Get<double>();
    axis.high = in->Get<double>();
    axis.bins = static_cast<int>(in->Get<std::int64_t>());
  }
  Summary s(static_cast<int>(r), axes);
  s.runs = in->Get<std::uint64_t>();
  s.measured = in->Get<std::uint64_t>();
  for (std::size_t k = in->GetSize(16); k > 0; --k) {
    const int outcome = static_cast<int>(in->Get<std::int64_t>());
    s.outcomes[outcome] = in->Get<std::uint64_t>();
  }
  for (std::size_t k = in->GetSize(24); k > 0; --k) {
    const int outcome = static_cast<int>(in->Get<std::int64_t>());
    const auto run = in->Get<std::uint64_t>();
    s.examples[outcome] = {run, in->GetText()};
  }
  for (std::size_t k = in->GetSize(16); k > 0; --k) {
    const std::string word = in->GetText();
    s.words[word] = in->Get<std::uint64_t>();
  }
  s.other_words = in->Get<std::uint64_t>();
  s.mean = GetVector(r, in);
  s.scatter = Eigen::Map<const Matrix>(GetVector(r * r, in).data(), r, r);
  s.smallest = GetVector(r, in);
  s.largest = GetVector(r, in);
  for (QuantileSketch& sketch : s.sketches) sketch = QuantileSketch::Read(in);
  for (auto& histogram : s.histograms) {
    const std::size_t size = histogram.size();
    histogram = in->GetVector<std::uint64_t>();
    if (histogram.size() != size) ByteReader::Refuse();
  }
  return s;
}

}  // namespace contact_flow
