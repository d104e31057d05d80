// SPDX-License-Identifier: BSD-3-Clause
#include <cstring>
#include <stdexcept>

#include "contact_flow/model/rigid_body/urdf_loader.h"

namespace contact_flow {
namespace {

int LineOf(const std::string& text, std::size_t position) {
  int line = 1;
  for (std::size_t k = 0; k < position && k < text.size(); ++k) line += text[k] == '\n';
  return line;
}

[[noreturn]] void FailAt(const std::string& text, std::size_t position, const std::string& what) {
  throw std::invalid_argument("URDF: " + what + " (line " + std::to_string(LineOf(text, position)) +
                              ")");
}

bool StartsWith(const std::string& text, std::size_t position, const char* prefix) {
  return text.compare(position, std::strlen(prefix), prefix) == 0;
}

/// The position after the next `end`.
std::size_t SkipTo(const std::string& text, std::size_t position, const char* end,
                   const char* what) {
  const std::size_t found = text.find(end, position);
  if (found == std::string::npos) FailAt(text, position, std::string(what) + " is never closed");
  return found + std::strlen(end);
}

/// More attributes of one element are not read: the parser compares each with all before.
constexpr int kMaxAttributes = 100;

/// The position after the tag that starts at `position`; `>` inside quotes does not end it.
std::size_t SkipTag(const std::string& text, std::size_t position) {
  char quote = 0;
  int attributes = 0;
  for (std::size_t k = position + 1; k < text.size(); ++k) {
    if (quote != 0) {
      if (text[k] == quote) quote = 0;
    } else if (text[k] == '"' || text[k] == '\'') {
      quote = text[k];
      if (++attributes > kMaxAttributes) {
        FailAt(text, k,
               "more than " + std::to_string(kMaxAttributes) + " attributes of one element");
      }
    } else if (text[k] == '<') {
      FailAt(text, k, "'<' inside a tag");
    } else if (text[k] == '>') {
      return k + 1;
    }
  }
  FailAt(text, position, "a tag is never closed");
}

/// The name of the tag that starts at `position`.
std::string TagName(const std::string& text, std::size_t position) {
  const std::size_t end = text.find_first_of(" \t\r\n/>", position);
  return text.substr(position, end == std::string::npos ? end : end - position);
}

}  // namespace

void CheckUrdfText(const std::string& text) {
  if (text.size() > kMaxUrdfBytes) {
    throw std::invalid_argument("URDF: " + std::to_string(text.size()) + " bytes, at most " +
                                std::to_string(kMaxUrdfBytes) + " are read");
  }
  for (std::size_t k = 0; k < text.size(); ++k) {
    const unsigned char byte = static_cast<unsigned char>(text[k]);
    if (byte < 0x20 && byte != '\t' && byte != '\n' && byte != '\r') {
      FailAt(text, k, "byte " + std::to_string(byte) + " is not allowed in XML");
    }
  }
  std::vector<std::string> open;
  int links = 0, elements = 0;
  for (std::size_t k = text.find('<'); k != std::string::npos; k = text.find('<', k)) {
    if (StartsWith(text, k, "<!--")) {
      k = SkipTo(text, k, "-->", "a comment");
    } else if (StartsWith(text, k, "<![CDATA[")) {
      k = SkipTo(text, k, "]]>", "a CDATA section");
    } else if (StartsWith(text, k, "<?")) {
      k = SkipTo(text, k, "?>", "a processing instruction");
    } else if (StartsWith(text, k, "<!")) {
      FailAt(text, k, "document types are not read");
    } else if (StartsWith(text, k, "</")) {
      const std::string name = TagName(text, k + 2);
      if (open.empty()) FailAt(text, k, "</" + name.substr(0, 80) + "> closes nothing");
      if (open.back() != name) {
        FailAt(text, k,
               "</" + name.substr(0, 80) + "> where <" + open.back().substr(0, 80) + "> is open");
      }
      open.pop_back();
      k = SkipTag(text, k);
    } else {
      const std::string name = TagName(text, k + 1);
      if (name.empty()) FailAt(text, k, "a tag without a name");
      if (open.empty() && ++elements > 1) FailAt(text, k, "more than one root element");
      if (name == "link" && ++links > kMaxUrdfLinks) {
        FailAt(text, k, "more than " + std::to_string(kMaxUrdfLinks) + " links");
      }
      const std::size_t end = SkipTag(text, k);
      if (text[end - 2] != '/') {
        open.push_back(name);
        if (open.size() > kMaxUrdfDepth) {
          FailAt(text, k, "elements nested deeper than " + std::to_string(kMaxUrdfDepth));
        }
      }
      k = end;
    }
  }
  if (elements == 0) FailAt(text, 0, "there is no XML element: is it the path of a file?");
  if (!open.empty()) FailAt(text, text.size(), "ends inside <" + open.back().substr(0, 80) + ">");
}

}  // namespace contact_flow
