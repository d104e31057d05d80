// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <cstring>
#include <stdexcept>
#include <string>
#include <type_traits>
#include <vector>

namespace contact_flow {

/// Numbers and texts as bytes, in the order of this machine (little-endian wherever we run).
class ByteWriter {
 public:
  /// A number.
  template <class T>
  void Put(T value) {
    static_assert(std::is_arithmetic<T>::value, "numbers only");
    const char* bytes = reinterpret_cast<const char*>(&value);
    bytes_.append(bytes, sizeof(T));
  }
  /// Its length and its bytes.
  void Put(const std::string& text) {
    Put(static_cast<std::uint64_t>(text.size()));
    bytes_ += text;
  }
  /// Its length and its numbers.
  template <class T>
  void Put(const std::vector<T>& values) {
    Put(static_cast<std::uint64_t>(values.size()));
    for (const T& value : values) Put(value);
  }
  /// All of it.
  const std::string& bytes() const { return bytes_; }

 private:
  std::string bytes_;
};

/// Reads them again. Throws std::invalid_argument where there are too few.
class ByteReader {
 public:
  /// `bytes` must outlive it.
  explicit ByteReader(const std::string& bytes) : bytes_(bytes) {}

  /// A number.
  template <class T>
  T Get() {
    T value;
    Need(sizeof(T));
    std::memcpy(&value, bytes_.data() + at_, sizeof(T));
    at_ += sizeof(T);
    return value;
  }
  /// A length, of things that take so many bytes each at least.
  std::size_t GetSize(std::size_t bytes_each) {
    const auto size = Get<std::uint64_t>();
    if (size > (bytes_.size() - at_) / bytes_each) Refuse();
    return static_cast<std::size_t>(size);
  }
  /// A text.
  std::string GetText() {
    const std::size_t size = GetSize(1);
    at_ += size;
    return bytes_.substr(at_ - size, size);
  }
  /// Numbers.
  template <class T>
  std::vector<T> GetVector() {
    std::vector<T> values(GetSize(sizeof(T)));
    for (T& value : values) value = Get<T>();
    return values;
  }
  /// Whether nothing is left.
  bool AtEnd() const { return at_ == bytes_.size(); }
  /// Throws.
  [[noreturn]] static void Refuse() {
    throw std::invalid_argument("these bytes are damaged, or of another version");
  }

 private:
  void Need(std::size_t size) const {
    if (size > bytes_.size() - at_) Refuse();
  }
  const std::string& bytes_;
  std::size_t at_ = 0;
};

}  // namespace contact_flow
