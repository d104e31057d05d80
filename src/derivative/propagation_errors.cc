// SPDX-License-Identifier: BSD-3-Clause
#include "propagation_errors.h"

#include <utility>

namespace contact_flow {

void ArcParts::Add(double t_begin, double t_end, const Matrix& step, const Matrix& phi) {
  if (parts_.empty() || steps_ == most_) {
    if (parts_.size() == kMost) Join();
    parts_.push_back({t_begin, t_end, parts_.empty() ? Matrix() : step});
    steps_ = 0;
  } else {
    if (parts_.size() > 1) parts_.back().phi = step * parts_.back().phi;
    parts_.back().t_end = t_end;
  }
  ++steps_;
  if (parts_.size() == 1 && steps_ == most_) parts_.front().phi = phi;
}

void ArcParts::Join() {
  for (std::size_t k = 0; 2 * k + 1 < parts_.size(); ++k) {
    ArcPart &first = parts_[2 * k], &second = parts_[2 * k + 1];
    parts_[k] = {first.t_begin, second.t_end, second.phi * first.phi};
  }
  parts_.resize(parts_.size() / 2);
  most_ *= 2;
}

std::vector<ArcPart> ArcParts::Take(double t_begin, double t_end, const Matrix& phi) {
  if (parts_.size() <= 1) return {{t_begin, t_end, phi}};
  return std::move(parts_);
}

}  // namespace contact_flow
