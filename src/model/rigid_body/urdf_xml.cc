// SPDX-License-Identifier: BSD-3-Clause
#include "urdf_xml.h"

#include <cmath>
#include <locale>
#include <sstream>

namespace contact_flow {
namespace {

const char kBlanks[] = " \t\r\n";

/// The five entities of XML as the letters they stand for.
std::string Decoded(const std::string& text) {
  static const std::pair<const char*, char> kEntities[] = {
      {"&lt;", '<'}, {"&gt;", '>'}, {"&amp;", '&'}, {"&quot;", '"'}, {"&apos;", '\''}};
  std::string decoded;
  for (std::size_t k = 0; k < text.size(); ++k) {
    bool found = false;
    for (const auto& entity : kEntities) {
      const std::string name = entity.first;
      if (text[k] != '&' || text.compare(k, name.size(), name) != 0) continue;
      decoded += entity.second;
      k += name.size() - 1;
      found = true;
      break;
    }
    if (!found) decoded += text[k];
  }
  return decoded;
}

class Reader {
 public:
  explicit Reader(const std::string& text) : text_(text) {}

  XmlElement Read() {
    XmlElement document;
    std::vector<XmlElement*> open = {&document};
    std::size_t k = 0;
    while ((k = text_.find('<', k)) != std::string::npos) {
      if (text_.compare(k, 4, "<!--") == 0) {
        k = text_.find("-->", k);
      } else if (text_.compare(k, 9, "<![CDATA[") == 0) {
        k = text_.find("]]>", k);
      } else if (text_.compare(k, 2, "<?") == 0) {
        k = text_.find("?>", k);
      } else if (text_.compare(k, 2, "</") == 0) {
        k = text_.find('>', k);
        if (k == std::string::npos || open.size() < 2) break;
        open.back()->end = k + 1;
        open.pop_back();
      } else {
        // Only the last child of each open element grows, so that the pointers hold.
        open.back()->children.emplace_back();
        XmlElement* element = &open.back()->children.back();
        element->begin = k;
        const bool empty = ReadTag(&k, element);
        if (k == std::string::npos) break;
        element->end = k;
        if (!empty) open.push_back(element);
      }
      if (k == std::string::npos) break;
    }
    return document.children.empty() ? XmlElement() : std::move(document.children.front());
  }

 private:
  /// Reads the tag at *k and moves *k behind it. True for <tag/>.
  bool ReadTag(std::size_t* k, XmlElement* element) {
    for (; line_at_ < *k; ++line_at_) line_ += text_[line_at_] == '\n';
    element->line = line_;
    std::size_t at = text_.find_first_of(" \t\r\n/>", *k + 1);
    element->name = text_.substr(*k + 1, at - *k - 1);
    while (at != std::string::npos && text_[at] != '>') {
      at = text_.find_first_not_of(" \t\r\n/", at);
      if (at == std::string::npos || text_[at] == '>') break;
      const std::size_t equal = text_.find_first_of("=>", at);
      if (equal == std::string::npos || text_[equal] == '>') {
        at = equal;
        break;
      }
      std::string key = text_.substr(at, equal - at);
      key.erase(key.find_last_not_of(kBlanks) + 1);
      const std::size_t quote = text_.find_first_not_of(kBlanks, equal + 1);
      if (quote == std::string::npos || (text_[quote] != '"' && text_[quote] != '\'')) {
        at = text_.find('>', equal);  // urdfdom's parser judges this
        break;
      }
      const std::size_t close = text_.find(text_[quote], quote + 1);
      if (close == std::string::npos) {
        at = close;
        break;
      }
      element->attributes.emplace_back(key, Decoded(text_.substr(quote + 1, close - quote - 1)));
      at = close + 1;
    }
    *k = at == std::string::npos ? at : at + 1;
    return at != std::string::npos && text_[at - 1] == '/';
  }

  const std::string& text_;
  std::size_t line_at_ = 0;
  int line_ = 1;
};

}  // namespace

std::string XmlElement::Attribute(const std::string& key, const std::string& otherwise) const {
  for (const auto& attribute : attributes) {
    if (attribute.first == key) return attribute.second;
  }
  return otherwise;
}

bool XmlElement::Has(const std::string& key) const {
  for (const auto& attribute : attributes) {
    if (attribute.first == key) return true;
  }
  return false;
}

const XmlElement* XmlElement::Child(const std::string& child) const {
  for (const XmlElement& element : children) {
    if (element.name == child) return &element;
  }
  return nullptr;
}

std::string AtLine(const XmlElement& element) {
  return " (line " + std::to_string(element.line) + ")";
}

XmlElement ReadXml(const std::string& text) { return Reader(text).Read(); }

bool ReadNumbers(const std::string& text, int count, double* numbers) {
  std::istringstream words(text);
  std::string word;
  int found = 0;
  while (words >> word) {
    std::istringstream stream(word);
    stream.imbue(std::locale::classic());
    double number = 0;
    stream >> number;
    if (stream.fail() || !stream.eof() || !std::isfinite(number) || found == count) return false;
    numbers[found++] = number;
  }
  return found == count;
}

}  // namespace contact_flow
