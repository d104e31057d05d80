// SPDX-License-Identifier: BSD-3-Clause
// Damaged and forged bags, as bytes. DAMAGED=10000 in the environment is a campaign.
#include <gtest/gtest.h>

#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <fstream>
#include <random>

#include "test/ros/bags/sample.h"

namespace contact_flow {
namespace ros_interface {
namespace {

class Damage {
 public:
  explicit Damage(unsigned seed) : random_(seed) {}

  std::string operator()(std::string bytes) {
    const std::size_t at = Below(bytes.size()), other = Below(bytes.size());
    const std::size_t size = 1 + Below(Below(2) ? 8 : 2000);
    const std::size_t here = std::min(size, bytes.size() - at);
    switch (Below(9)) {
      case 0:
        bytes[at] = static_cast<char>(bytes[at] ^ (1 << Below(8)));
        break;
      case 1:
        bytes[at] = static_cast<char>(Below(256));
        break;
      case 2:
        bytes.resize(at);
        break;
      case 3:
        std::fill_n(bytes.begin() + static_cast<long>(at), here, '\0');
        break;
      case 4:
        for (std::size_t i = at; i < at + here; ++i) bytes[i] = static_cast<char>(Below(256));
        break;
      case 5:
        bytes.erase(at, size);
        break;
      case 6:
        bytes.insert(other, bytes.substr(at, size));
        break;
      case 7:
        bytes += std::string(size, static_cast<char>(Below(256)));
        break;
      default:  // a length, most likely
        for (std::size_t i = at; i < std::min(at + 4, bytes.size()); ++i) bytes[i] = '\xff';
    }
    return bytes;
  }

 private:
  std::size_t Below(std::size_t n) {
    return std::uniform_int_distribution<std::size_t>(0, n - 1)(random_);
  }
  std::mt19937 random_;
};

// No byte can be changed unseen: every one belongs to what is hashed, or is said twice.
TEST(Chain, EveryDamageIsFound) {
  const char* asked = std::getenv("DAMAGED");
  const int count = asked ? std::atoi(asked) : 3000;
  const std::string sound = SampleBag(40);
  ASSERT_EQ(Complaint(sound), "");
  Damage damage(7);
  for (int k = 0; k < count; ++k) {
    const std::string damaged = damage(sound);
    if (damaged != sound) {
      ASSERT_NE(Complaint(damaged), "") << "damage " << k;
    }
  }
}

TEST(Chain, EverySingleByteCounts) {
  const std::string sound = SampleBag(5);
  for (std::size_t i = 0; i < sound.size(); ++i) {
    if (i > 200 && i < 4000) continue;  // the padding, above
    std::string damaged = sound;
    damaged[i] = static_cast<char>(damaged[i] ^ 0x10);
    ASSERT_NE(Complaint(damaged), "") << "byte " << i;
  }
}

/// Messages of a sample, changed, and written with a sound index: the chain alone can tell.
std::string Forged(const std::function<void(std::vector<BagMessage>*)>& change,
                   std::shared_ptr<const SigningKey> key = nullptr,
                   std::shared_ptr<const SigningKey> checked_by = nullptr) {
  const std::string bytes = SampleBag(40, std::move(key));
  std::vector<BagMessage> messages = ReadBag(bytes).messages;
  change(&messages);
  return Complaint(Reindexed(messages), std::move(checked_by));
}

TEST(Chain, WrittenAnewItIsTheSame) {
  EXPECT_EQ(Forged([](auto*) {}), "");
}

TEST(Chain, WhatIsCutOutIsMissed) {
  EXPECT_NE(Forged([](auto* m) { m->erase(m->begin() + 7); }).find("1 of messages"),
            std::string::npos);
  // messages and the links over them
  EXPECT_NE(Forged([](auto* m) { m->erase(m->begin() + 5, m->begin() + 15); }).find("missing"),
            std::string::npos);
  // the end, with and without the messages before it
  EXPECT_NE(Forged([](auto* m) { m->pop_back(); }).find("not ended"), std::string::npos);
  EXPECT_NE(Forged([](auto* m) { m->resize(20); }).find("gap"), std::string::npos);
  // the beginning
  EXPECT_NE(Forged([](auto* m) { m->erase(m->begin()); }).find("does not begin"),
            std::string::npos);
}

TEST(Chain, WhatIsChangedDiffers) {
  EXPECT_NE(Forged([](auto* m) { m->insert(m->begin() + 7, (*m)[6]); }).find("differs"),
            std::string::npos);
  EXPECT_NE(Forged([](auto* m) { std::swap((*m)[7].data, (*m)[8].data); }).find("differs"),
            std::string::npos);
  EXPECT_NE(Forged([](auto* m) { (*m)[7].time += ros::Duration(0, 1); }).find("differs"),
            std::string::npos);
  EXPECT_NE(Forged([](auto* m) {
              BagFields fields = *(*m)[7].connection;
              fields["topic"] = "/node/another";
              (*m)[7].connection = std::make_shared<const BagFields>(fields);
            }).find("differs"),
            std::string::npos);
  const std::string other = SampleBag(40);
  const BagContent of_another = ReadBag(other);
  EXPECT_NE(Forged([&](auto* m) { m->back() = of_another.messages.back(); }).find("another"),
            std::string::npos);
}

TEST(Chain, OneThatWasNotEndedIsIncomplete) {
  EXPECT_NE(Complaint(SampleBag(20, nullptr, false)).find("not ended"), std::string::npos);
}

TEST(Chain, SignaturesAreOfOneKeyAlone) {
  const std::string directory = testing::TempDir();
  for (const char* name : {"a", "b"}) {
    const std::string path = directory + name;
    ASSERT_EQ(
        std::system(("openssl genpkey -algorithm ed25519 -out " + path +
                     ".pem && openssl pkey -in " + path + ".pem -pubout -out " + path + ".pub")
                        .c_str()),
        0);
  }
  const auto a = SigningKey::ReadPrivate(directory + "a.pem");
  const auto public_a = SigningKey::ReadPublic(directory + "a.pub");
  const auto public_b = SigningKey::ReadPublic(directory + "b.pub");
  EXPECT_EQ(a->PublicHex(), public_a->PublicHex());
  EXPECT_EQ(Complaint(SampleBag(20, a)), "");  // whoever does not ask for a signature
  EXPECT_EQ(Complaint(SampleBag(20, a), public_a), "");
  EXPECT_NE(Complaint(SampleBag(20, a), public_b).find("not of this key"), std::string::npos);
  EXPECT_NE(Complaint(SampleBag(20), public_a).find("not signed"), std::string::npos);
  EXPECT_THROW(SigningKey::ReadPrivate(directory + "a.pub"), std::invalid_argument);
  EXPECT_THROW(SigningKey::ReadPublic(directory + "none.pub"), std::invalid_argument);
}

}  // namespace
}  // namespace ros_interface
}  // namespace contact_flow
