// SPDX-License-Identifier: BSD-3-Clause
#include "record_chain.h"

#include <openssl/evp.h>
#include <openssl/pem.h>
#include <openssl/rand.h>

#include <algorithm>
#include <cerrno>
#include <cstdio>
#include <cstring>
#include <stdexcept>

namespace contact_flow {
namespace ros_interface {
namespace {

void Check(int done) {
  if (done != 1) throw std::runtime_error("libcrypto failed");
}

std::string Hex(const std::uint8_t* bytes, std::size_t size) {
  std::string text;
  char two[3];
  for (std::size_t i = 0; i < size; ++i) {
    std::snprintf(two, sizeof(two), "%02x", bytes[i]);
    text += two;
  }
  return text;
}

std::string RandomName() {
  std::uint8_t bytes[16];
  Check(RAND_bytes(bytes, sizeof(bytes)));
  return Hex(bytes, sizeof(bytes));
}

EVP_PKEY* ReadKey(const std::string& path, bool is_private) {
  std::FILE* file = std::fopen(path.c_str(), "re");
  if (file == nullptr) {
    throw std::invalid_argument("key " + path + ": " + std::strerror(errno));
  }
  EVP_PKEY* key = is_private ? PEM_read_PrivateKey(file, nullptr, nullptr, nullptr)
                             : PEM_read_PUBKEY(file, nullptr, nullptr, nullptr);
  std::fclose(file);
  if (key == nullptr || EVP_PKEY_id(key) != EVP_PKEY_ED25519) {
    EVP_PKEY_free(key);
    throw std::invalid_argument("key " + path + ": is no " + (is_private ? "private" : "public") +
                                " Ed25519 key in PEM format (openssl genpkey -algorithm ed25519)");
  }
  return key;
}

}  // namespace

Hash::Hash() : context_(EVP_MD_CTX_new()) {
  Check(EVP_DigestInit_ex(static_cast<EVP_MD_CTX*>(context_), EVP_sha256(), nullptr));
}
Hash::Hash(const Hash& other) : Hash() { *this = other; }
Hash& Hash::operator=(const Hash& other) {
  if (this != &other) {
    Check(EVP_MD_CTX_copy_ex(static_cast<EVP_MD_CTX*>(context_),
                             static_cast<const EVP_MD_CTX*>(other.context_)));
  }
  return *this;
}
Hash::~Hash() { EVP_MD_CTX_free(static_cast<EVP_MD_CTX*>(context_)); }

void Hash::Feed(const void* data, std::size_t size) {
  Check(EVP_DigestUpdate(static_cast<EVP_MD_CTX*>(context_), data, size));
}

void Hash::Feed(const std::string& text) {
  const auto size = static_cast<std::uint64_t>(text.size());
  Feed(&size, sizeof(size));
  Feed(text.data(), text.size());
}

Digest Hash::Take() {
  Digest digest;
  Check(EVP_DigestFinal_ex(static_cast<EVP_MD_CTX*>(context_), digest.data(), nullptr));
  Check(EVP_DigestInit_ex(static_cast<EVP_MD_CTX*>(context_), EVP_sha256(), nullptr));
  return digest;
}

Digest HashOf(const BagFields& connection) {
  Hash hash;
  for (const auto& [name, value] : connection) {
    hash.Feed(name);
    hash.Feed(value);
  }
  return hash.Take();
}

std::shared_ptr<const SigningKey> SigningKey::ReadPrivate(const std::string& path) {
  return std::shared_ptr<const SigningKey>(new SigningKey(ReadKey(path, true)));
}
std::shared_ptr<const SigningKey> SigningKey::ReadPublic(const std::string& path) {
  return std::shared_ptr<const SigningKey>(new SigningKey(ReadKey(path, false)));
}
SigningKey::~SigningKey() { EVP_PKEY_free(static_cast<EVP_PKEY*>(key_)); }

std::string SigningKey::PublicHex() const {
  std::uint8_t bytes[32];
  std::size_t size = sizeof(bytes);
  Check(EVP_PKEY_get_raw_public_key(static_cast<EVP_PKEY*>(key_), bytes, &size));
  return Hex(bytes, size);
}

Bytes SigningKey::Sign(const Digest& digest) const {
  const std::unique_ptr<EVP_MD_CTX, decltype(&EVP_MD_CTX_free)> context(EVP_MD_CTX_new(),
                                                                        &EVP_MD_CTX_free);
  Bytes signature(64);
  std::size_t size = signature.size();
  Check(EVP_DigestSignInit(context.get(), nullptr, nullptr, nullptr, static_cast<EVP_PKEY*>(key_)));
  Check(EVP_DigestSign(context.get(), signature.data(), &size, digest.data(), digest.size()));
  return signature;
}

bool SigningKey::Verifies(const Digest& digest, const Bytes& signature) const {
  const std::unique_ptr<EVP_MD_CTX, decltype(&EVP_MD_CTX_free)> context(EVP_MD_CTX_new(),
                                                                        &EVP_MD_CTX_free);
  Check(
      EVP_DigestVerifyInit(context.get(), nullptr, nullptr, nullptr, static_cast<EVP_PKEY*>(key_)));
  return signature.size() == 64 &&
         EVP_DigestVerify(context.get(), signature.data(), signature.size(), digest.data(),
                          digest.size()) == 1;
}

void LinkHash::Add(const Digest& connection, const ros::Time& time, const std::uint8_t* data,
                   std::size_t size) {
  const std::uint64_t numbers[3] = {time.sec, time.nsec, size};
  hash_.Feed(connection.data(), connection.size());
  hash_.Feed(numbers, sizeof(numbers));
  hash_.Feed(data, size);
  ++count_;
}

Digest LinkHash::Take(RecordingLink link) {
  link.digest.fill(0);
  link.signature.clear();
  const Bytes fields = Serialize(link);
  hash_.Feed("contact_flow/RecordingLink 1");
  hash_.Feed(fields.data(), fields.size());
  count_ = 0;
  return hash_.Take();
}

RecordChain::RecordChain(std::shared_ptr<const SigningKey> key)
    : recording_(RandomName()), key_(std::move(key)) {}

void RecordChain::Add(const Digest& connection, const ros::Time& time, const Bytes& data) {
  hash_.Add(connection, time, data.data(), data.size());
  ++messages_;
}

RecordingLink RecordChain::Link(const ros::Time& time, std::uint8_t state) {
  RecordingLink link;
  link.header.stamp = time;
  link.recording = recording_;
  link.index = ++links_;
  link.count = hash_.count();
  link.first = messages_ - link.count + 1;
  link.state = state;
  std::copy(last_.begin(), last_.end(), link.previous.begin());
  last_ = hash_.Take(link);
  std::copy(last_.begin(), last_.end(), link.digest.begin());
  if (key_) link.signature = key_->Sign(last_);
  return link;
}

}  // namespace ros_interface
}  // namespace contact_flow
