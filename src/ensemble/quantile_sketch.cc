// SPDX-License-Identifier: BSD-3-Clause
#include "contact_flow/ensemble/quantile_sketch.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "contact_flow/ensemble/philox.h"

namespace contact_flow {

void QuantileSketch::Add(double value) {
  if (levels_.empty()) levels_.emplace_back();
  levels_[0].push_back(value);
  ++unsorted_;
  ++count_;
  if (levels_[0].size() >= 2 * kCapacity) Compact();
}

void QuantileSketch::Sort() {
  if (unsorted_ == 0) return;
  std::sort(levels_[0].begin(), levels_[0].end());
  unsorted_ = 0;
}

void QuantileSketch::Merge(const QuantileSketch& other) {
  if (levels_.size() < other.levels_.size()) levels_.resize(other.levels_.size());
  for (std::size_t h = 0; h < other.levels_.size(); ++h) {
    levels_[h].insert(levels_[h].end(), other.levels_[h].begin(), other.levels_[h].end());
    std::sort(levels_[h].begin(), levels_[h].end());
  }
  unsorted_ = 0;
  count_ += other.count_;
  rank_error_ += other.rank_error_;
  compactions_ += other.compactions_;
  Compact();
}

void QuantileSketch::Compact() {
  Sort();
  for (std::size_t h = 0; h < levels_.size(); ++h) {
    if (levels_[h].size() < 2 * kCapacity) continue;
    if (h + 1 == levels_.size()) levels_.emplace_back();
    std::vector<double>& from = levels_[h];
    std::vector<double>& to = levels_[h + 1];
    const std::size_t even = from.size() / 2 * 2;  // an odd one stays
    const std::size_t first = Philox(compactions_++, h).Next() & 1;
    for (std::size_t k = first; k < even; k += 2) to.push_back(from[k]);
    std::sort(to.begin(), to.end());
    from.erase(from.begin(), from.begin() + static_cast<std::ptrdiff_t>(even));
    rank_error_ += std::uint64_t{1} << h;
  }
}

double QuantileSketch::Quantile(double p) const {
  if (count_ == 0 || std::isnan(p)) return std::numeric_limits<double>::quiet_NaN();
  std::vector<std::pair<double, std::uint64_t>> weighted;
  for (std::size_t h = 0; h < levels_.size(); ++h) {
    for (double value : levels_[h]) weighted.emplace_back(value, std::uint64_t{1} << h);
  }
  std::sort(weighted.begin(), weighted.end());
  const double wanted = std::min(std::max(p, 0.0), 1.0) * static_cast<double>(count_);
  std::uint64_t below = 0;
  for (const auto& [value, weight] : weighted) {
    below += weight;
    if (static_cast<double>(below) >= wanted) return value;
  }
  return weighted.back().first;
}

void QuantileSketch::Write(ByteWriter* out) const {
  QuantileSketch sorted = *this;
  sorted.Sort();
  out->Put(count_);
  out->Put(rank_error_);
  out->Put(compactions_);
  out->Put(static_cast<std::uint64_t>(levels_.size()));
  for (const auto& level : sorted.levels_) out->Put(level);
}

QuantileSketch QuantileSketch::Read(ByteReader* in) {
  QuantileSketch sketch;
  sketch.count_ = in->Get<std::uint64_t>();
  sketch.rank_error_ = in->Get<std::uint64_t>();
  sketch.compactions_ = in->Get<std::uint64_t>();
  sketch.levels_.resize(in->GetSize(8));
  std::uint64_t weight = 0;
  if (sketch.levels_.size() > 63) ByteReader::Refuse();
  for (std::size_t h = 0; h < sketch.levels_.size(); ++h) {
    sketch.levels_[h] = in->GetVector<double>();
    weight += std::uint64_t{sketch.levels_[h].size()} << h;
    if (!std::is_sorted(sketch.levels_[h].begin(), sketch.levels_[h].end())) ByteReader::Refuse();
  }
  if (weight != sketch.count_) ByteReader::Refuse();
  return sketch;
}

}  // namespace contact_flow
