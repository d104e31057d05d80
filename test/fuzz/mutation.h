// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <random>
#include <string>
#include <vector>

namespace contact_flow {
namespace fuzz {

/// Damages texts as people and programs do: bytes, numbers, names, lines and elements changed,
/// lost, doubled, moved and taken from other texts. What comes out depends on the generator alone,
/// on any machine.
class Mutator {
 public:
  explicit Mutator(std::mt19937* generator) : generator_(generator) {}

  /// One of `corpus` with a few changes; never longer than `max_size`.
  std::string Mutate(const std::vector<std::string>& corpus, std::size_t max_size);

 private:
  std::size_t Below(std::size_t n) { return n == 0 ? 0 : (*generator_)() % n; }
  void Change(const std::string& other, std::string* text);
  /// A random span of the text that begins with `begin` and ends before the next `end`.
  struct Span {
    std::size_t begin, size;
  };
  Span Find(const std::string& text, const char* begin, const char* end);

  std::mt19937* generator_;
};

}  // namespace fuzz
}  // namespace contact_flow
