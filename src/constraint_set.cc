// SPDX-License-Identifier: BSD-3-Clause
#include "contact_flow/constraint_set.h"

#include <algorithm>
#include <utility>

namespace contact_flow {

ConstraintSet ConstraintSet::FromWords(const Words& words) {
  ConstraintSet set;
  if (!words.empty()) set.low_ = words[0];
  if (words.size() > 1) set.high_ = words[1];
  if (words.size() > 2) {
    Words beyond(words.begin() + 2, words.end());
    set.KeepBeyond(&beyond);
  }
  return set;
}

ConstraintSet::Words ConstraintSet::words() const {
  Words words = {low_, high_};
  if (beyond_ != nullptr) words.insert(words.end(), beyond_->begin(), beyond_->end());
  return words;
}

void ConstraintSet::Iterator::Begin(const ConstraintSet& set) {
  beyond_ = set.beyond_;
  if ((low_ | high_) == 0) GoBeyond();
}

void ConstraintSet::Iterator::GoBeyond() {
  const auto at = static_cast<std::size_t>(first_ / 64);  // first_ + 128 is the next one's index
  const std::size_t size = beyond_->size();
  for (std::size_t k = at; k < size; k += 2) {
    low_ = (*beyond_)[k];
    high_ = k + 1 < size ? (*beyond_)[k + 1] : 0;
    if ((low_ | high_) == 0) continue;
    first_ = kInPlace + 64 * static_cast<int>(k);
    return;
  }
}

void ConstraintSet::KeepBeyond(Words* words) {
  while (!words->empty() && words->back() == 0) words->pop_back();
  beyond_ = words->empty() ? nullptr : std::make_shared<const Words>(std::move(*words));
}

ConstraintSet ConstraintSet::AllBeyond(int n) {
  ConstraintSet set(LeastBits(64), LeastBits(64), InPlace());
  Words beyond;
  for (int left = n - kInPlace; left > 0; left -= 64) beyond.push_back(LeastBits(left));
  set.KeepBeyond(&beyond);
  return set;
}

bool ConstraintSet::ContainsBeyond(int i) const {
  const auto word = static_cast<std::size_t>(i - kInPlace) / 64;
  return word < beyond_->size() && ((*beyond_)[word] >> (i & 63) & 1) != 0;
}

int ConstraintSet::SizeBeyond() const {
  int size = 0;
  for (std::uint64_t word : *beyond_) size += __builtin_popcountll(word);
  return size;
}

void ConstraintSet::PutBeyond(int i, bool member) {
  if (Contains(i) == member) return;
  const auto word = static_cast<std::size_t>(i - kInPlace) / 64;
  Words beyond = beyond_ == nullptr ? Words() : *beyond_;
  beyond.resize(std::max(beyond.size(), word + 1));
  beyond[word] ^= std::uint64_t{1} << (i & 63);
  KeepBeyond(&beyond);
}

void ConstraintSet::UniteBeyond(const ConstraintSet& a, const ConstraintSet& b) {
  if (a.beyond_ == b.beyond_ || b.beyond_ == nullptr) {
    beyond_ = a.beyond_;
    return;
  }
  if (a.beyond_ == nullptr) {
    beyond_ = b.beyond_;
    return;
  }
  Words beyond = *a.beyond_;
  beyond.resize(std::max(beyond.size(), b.beyond_->size()));
  for (std::size_t k = 0; k < b.beyond_->size(); ++k) beyond[k] |= (*b.beyond_)[k];
  KeepBeyond(&beyond);
}

void ConstraintSet::IntersectBeyond(const ConstraintSet& a, const ConstraintSet& b) {
  if (a.beyond_ == b.beyond_) {
    beyond_ = a.beyond_;
    return;
  }
  Words beyond = *a.beyond_;
  beyond.resize(std::min(beyond.size(), b.beyond_->size()));
  for (std::size_t k = 0; k < beyond.size(); ++k) beyond[k] &= (*b.beyond_)[k];
  KeepBeyond(&beyond);
}

void ConstraintSet::SubtractBeyond(const ConstraintSet& a, const ConstraintSet& b) {
  if (b.beyond_ == nullptr) {
    beyond_ = a.beyond_;
    return;
  }
  Words beyond = *a.beyond_;
  const std::size_t both = std::min(beyond.size(), b.beyond_->size());
  for (std::size_t k = 0; k < both; ++k) beyond[k] &= ~(*b.beyond_)[k];
  KeepBeyond(&beyond);
}

bool ConstraintSet::SameBeyond(const ConstraintSet& a, const ConstraintSet& b) {
  return a.beyond_ != nullptr && b.beyond_ != nullptr && *a.beyond_ == *b.beyond_;
}

int ConstraintSet::CompareBeyond(const ConstraintSet& a, const ConstraintSet& b) {
  const Words none, &x = a.beyond_ == nullptr ? none : *a.beyond_,
                    &y = b.beyond_ == nullptr ? none : *b.beyond_;
  if (x.size() != y.size()) return x.size() < y.size() ? -1 : 1;
  for (std::size_t k = x.size(); k-- > 0;) {
    if (x[k] != y[k]) return x[k] < y[k] ? -1 : 1;
  }
  return 0;
}

std::vector<std::string> ConstraintSet::Names(const std::vector<std::string>& constraints) const {
  std::vector<std::string> names;
  for (int i : *this) names.push_back(constraints[i]);
  return names;
}

std::string ConstraintSet::ToString(const std::vector<std::string>& constraints) const {
  std::string text = "{";
  for (int i : *this) text += (text.size() > 1 ? ", " : "") + constraints[i];
  return text + "}";
}

}  // namespace contact_flow
