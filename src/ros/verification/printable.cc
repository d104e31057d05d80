// SPDX-License-Identifier: BSD-3-Clause
#include "printable.h"

#include <cstddef>

namespace contact_flow {
namespace ros_interface {
namespace {

/// The length of the UTF-8 character at `at`, 0 where there is none (RFC 3629).
std::size_t LengthOfCharacter(const std::string& text, std::size_t at) {
  const auto byte = [&](std::size_t k) {
    return k < text.size() ? static_cast<unsigned char>(text[k]) : 0u;
  };
  const unsigned first = byte(at);
  if (first < 0x80) return 1;
  const std::size_t length = first >= 0xc2 && first < 0xe0   ? 2
                             : first >= 0xe0 && first < 0xf0 ? 3
                             : first >= 0xf0 && first < 0xf5 ? 4
                                                             : 0;
  for (std::size_t k = 1; k < length; ++k) {
    if ((byte(at + k) & 0xc0) != 0x80) return 0;
  }
  const unsigned second = byte(at + 1);
  const bool overlong = (first == 0xe0 && second < 0xa0) || (first == 0xf0 && second < 0x90);
  const bool none = (first == 0xed && second >= 0xa0) || (first == 0xf4 && second >= 0x90);
  return overlong || none ? 0 : length;
}

bool IsControl(const std::string& text, std::size_t at, std::size_t length) {
  const auto first = static_cast<unsigned char>(text[at]);
  if (length == 1) return (first < 0x20 && first != '\n' && first != '\t') || first == 0x7f;
  return first == 0xc2 && static_cast<unsigned char>(text[at + 1]) < 0xa0;  // C1
}

}  // namespace

std::string Printable(const std::string& text) {
  constexpr char kDigits[] = "0123456789abcdef";
  std::string printable;
  for (std::size_t at = 0; at < text.size();) {
    const std::size_t length = LengthOfCharacter(text, at);
    if (length > 0 && !IsControl(text, at, length)) {
      printable.append(text, at, length);
      at += length;
      continue;
    }
    const auto byte = static_cast<unsigned char>(text[at++]);
    printable += {'\\', 'x', kDigits[byte >> 4], kDigits[byte & 15]};
  }
  return printable;
}

PrintableBuffer::int_type PrintableBuffer::overflow(int_type character) {
  if (traits_type::eq_int_type(character, traits_type::eof())) {
    return traits_type::not_eof(character);
  }
  line_ += traits_type::to_char_type(character);
  if (line_.back() != '\n') return character;
  const std::string printable = Printable(line_);
  line_.clear();
  const auto size = static_cast<std::streamsize>(printable.size());
  return out_->sputn(printable.data(), size) == size ? character : traits_type::eof();
}

int PrintableBuffer::sync() {
  const std::string printable = Printable(line_);
  line_.clear();
  const auto size = static_cast<std::streamsize>(printable.size());
  if (out_->sputn(printable.data(), size) != size) return -1;
  return out_->pubsync();
}

}  // namespace ros_interface
}  // namespace contact_flow
