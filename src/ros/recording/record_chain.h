// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <ros/time.h>

#include <array>
#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "bag_format.h"
#include "contact_flow/RecordingLink.h"
#include "src/ros/message/serialize.h"

namespace contact_flow {
namespace ros_interface {

using Digest = std::array<std::uint8_t, 32>;

/// SHA-256 of what it is fed.
class Hash {
 public:
  Hash();
  Hash(const Hash& other);
  Hash& operator=(const Hash& other);
  ~Hash();
  void Feed(const void* data, std::size_t size);
  void Feed(const std::string& text);  ///< with its length
  Digest Take();                       ///< and begins anew

 private:
  void* context_;
};

/// What the fields of a connection (topic, type, definition, …) contribute to each message's hash.
Digest HashOf(const BagFields& connection);

/// An Ed25519 key that signs links, or checks signatures.
class SigningKey {
 public:
  /// Of a PEM file: a private key, as of `openssl genpkey -algorithm ed25519`. Throws
  /// std::invalid_argument, with path and reason.
  static std::shared_ptr<const SigningKey> ReadPrivate(const std::string& path);
  /// A public key, as of `openssl pkey -pubout`.
  static std::shared_ptr<const SigningKey> ReadPublic(const std::string& path);
  SigningKey(const SigningKey&) = delete;
  SigningKey& operator=(const SigningKey&) = delete;
  ~SigningKey();

  std::string PublicHex() const;
  Bytes Sign(const Digest& digest) const;
  bool Verifies(const Digest& digest, const Bytes& signature) const;

 private:
  explicit SigningKey(void* key) : key_(key) {}
  void* key_;
};

/// The messages that a link covers, hashed one by one.
class LinkHash {
 public:
  void Add(const Digest& connection, const ros::Time& time, const std::uint8_t* data,
           std::size_t size);
  std::uint32_t count() const { return count_; }
  /// The digest of `link`, whose own digest and signature are not read; then begins anew.
  Digest Take(RecordingLink link);

 private:
  Hash hash_;
  std::uint32_t count_ = 0;
};

/// The chain over a recording as it is made. A copy is the chain as it was.
class RecordChain {
 public:
  explicit RecordChain(std::shared_ptr<const SigningKey> key = nullptr);
  /// 128 random bits.
  const std::string& recording() const { return recording_; }
  std::uint64_t messages() const { return messages_; }
  const Digest& last() const { return last_; }
  /// Of the key, or "".
  std::string PublicHex() const { return key_ ? key_->PublicHex() : ""; }

  void Add(const Digest& connection, const ros::Time& time, const Bytes& data);
  std::uint32_t open() const { return hash_.count(); }  ///< messages since the last link
  RecordingLink Link(const ros::Time& time, std::uint8_t state);

 private:
  std::string recording_;
  std::shared_ptr<const SigningKey> key_;
  LinkHash hash_;
  Digest last_{};
  std::uint64_t messages_ = 0, links_ = 0;
};

}  // namespace ros_interface
}  // namespace contact_flow
