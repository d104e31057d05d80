// SPDX-License-Identifier: BSD-3-Clause
#include "test/fuzz/mutation.h"

#include <algorithm>
#include <cstring>

namespace contact_flow {
namespace fuzz {
namespace {

const char* const kNumbers[] = {"nan",   "-nan",   "inf",   ".inf",    ".nan",
                                "1e999", "-1e999", "1e308", "-1e308",  "1e-320",
                                "0",     "-0",     "-1",    "1",       "1e-12",
                                "1e12",  "0x10",   "1,5",   "1e",      "9999999999999999999999",
                                "",      " ",      "1 2",   "1 2 3 4", "3.14159"};
const char* const kPieces[] = {"\"",
                               "<",
                               ">",
                               "/>",
                               "</",
                               "<!--",
                               "-->",
                               "]]>",
                               "<![CDATA[",
                               "<?",
                               "?>",
                               "<!DOCTYPE",
                               "&#0;",
                               "&lt;",
                               "&a;",
                               "\xef\xbb\xbf",
                               "\xff",
                               "\xc3",
                               "<link/>",
                               "<link name=\"\"/>",
                               "<joint/>",
                               "<inertial/>",
                               "<origin rpy=\"1 1 1\"/>",
                               "<mimic joint=\"a\"/>",
                               "type=\"floating\"",
                               "type=\"planar\"",
                               "type=\"fixed\"",
                               ":",
                               "- ",
                               "{",
                               "}",
                               "[",
                               "]",
                               "\n",
                               "  ",
                               "\t",
                               "&a ",
                               "*a",
                               "~",
                               "''",
                               "? ",
                               "!!binary ",
                               "|\n",
                               ">\n",
                               "#",
                               "%s%s%s%s%n",
                               "%.3]",
                               "---\n",
                               "...\n",
                               "<<: *a",
                               "kind: spheres",
                               "kind: height_field",
                               "kind: link_plane",
                               "kind: point_spring",
                               "base: planar\n",
                               "base: floating\n",
                               "\n%%% YAML\n"};

bool IsNumber(char letter) {
  return std::strchr("+-.0123456789eE", letter) != nullptr && letter != 0;
}
bool IsName(char letter) {
  return (letter >= 'a' && letter <= 'z') || (letter >= '0' && letter <= '9') || letter == '_';
}

}  // namespace

Mutator::Span Mutator::Find(const std::string& text, const char* begin, const char* end) {
  std::size_t at = text.find(begin, Below(text.size()));
  if (at == std::string::npos) at = text.find(begin);
  if (at == std::string::npos) return {0, 0};
  std::size_t stop = text.find(end, at + std::strlen(begin));
  stop = stop == std::string::npos ? text.size() : stop + std::strlen(end);
  return {at, stop - at};
}

void Mutator::Change(const std::string& other, std::string* text) {
  const std::size_t at = Below(text->size()), length = 1 + Below(40);
  const auto token = [&](bool (*belongs)(char)) {  // around or after `at`
    std::size_t begin = at;
    while (begin < text->size() && !belongs((*text)[begin])) ++begin;
    std::size_t end = begin;
    while (end < text->size() && belongs((*text)[end])) ++end;
    return Span{begin, end - begin};
  };
  switch (Below(11)) {
    case 0:
      (*text)[at] = static_cast<char>(Below(256));
      break;
    case 1:
      (*text)[at] = static_cast<char>((*text)[at] ^ (1 << Below(8)));
      break;
    case 2:
      text->erase(at, length);
      break;
    case 3:
      text->insert(Below(text->size()), text->substr(at, length));
      break;
    case 4:
      text->insert(at, kPieces[Below(sizeof(kPieces) / sizeof(kPieces[0]))]);
      break;
    case 5: {  // a number
      const Span number = token(&IsNumber);
      text->replace(number.begin, number.size,
                    kNumbers[Below(sizeof(kNumbers) / sizeof(kNumbers[0]))]);
      break;
    }
    case 6: {  // one name for another
      const Span name = token(&IsName);
      const std::size_t from = Below(other.size());
      std::size_t begin = from;
      while (begin < other.size() && !IsName(other[begin])) ++begin;
      std::size_t end = begin;
      while (end < other.size() && IsName(other[end])) ++end;
      text->replace(name.begin, name.size, other.substr(begin, end - begin));
      break;
    }
    case 7: {  // a line, or an element, lost or doubled
      const char* const begins[] = {"\n", "<joint", "<link", "<inertial", "<"};
      const char* const ends[] = {"\n", "</joint>", "</link>", "</inertial>", ">"};
      const std::size_t k = Below(5);
      const Span span = Find(*text, begins[k], ends[k]);
      if (Below(2) == 0) {
        text->erase(span.begin, span.size);
      } else {
        text->insert(span.begin, text->substr(span.begin, span.size));
      }
      break;
    }
    case 8:  // cut
      if (Below(4) == 0) text->resize(at);
      break;
    case 9:  // a piece of another text
      text->insert(at, other, Below(other.size()), 1 + Below(400));
      break;
    default: {  // a number grows out of range
      const Span number = token(&IsNumber);
      text->insert(number.begin + number.size, Below(2) == 0 ? "e200" : "e-200");
    }
  }
}

std::string Mutator::Mutate(const std::vector<std::string>& corpus, std::size_t max_size) {
  std::string text = corpus[Below(corpus.size())];
  const std::string& other = corpus[Below(corpus.size())];
  for (std::size_t changes = 1 + Below(4); changes-- > 0;) {
    if (text.empty()) text = "<robot/>";
    Change(other, &text);
  }
  if (text.size() > max_size) text.resize(max_size);
  return text;
}

}  // namespace fuzz
}  // namespace contact_flow
