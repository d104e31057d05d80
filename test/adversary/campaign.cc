// SPDX-License-Identifier: BSD-3-Clause
#include "test/adversary/campaign.h"

#include <algorithm>
#include <atomic>
#include <exception>
#include <iostream>
#include <mutex>
#include <thread>

namespace contact_flow {
namespace adversary {
namespace {

constexpr long kProgress = 500;  // systems between two lines of progress

}  // namespace

const char* Name(Verdict::Kind kind) {
  switch (kind) {
    case Verdict::Kind::kRight:
      return "right";
    case Verdict::Kind::kRefused:
      return "refused";
    case Verdict::Kind::kSkipped:
      return "skipped";
    case Verdict::Kind::kContradicted:
      return "contradicted";
  }
  return "";
}

long Campaign::Count(const std::string& kind) const {
  long count = 0;
  if (kind == "right") {
    for (const auto& [generator, number] : right) count += number;
  }
  const auto found = others.find(kind);
  if (found == others.end()) return count;
  for (const auto& [reason, number] : found->second) count += number;
  return count;
}

namespace {

void PrintFinding(const Campaign::Finding& finding, std::ostream* out) {
  *out << "CONTRADICTED seed " << finding.seed << " (" << finding.generator << ", "
       << finding.reason << "): " << finding.detail << "\n";
}

}  // namespace

void Campaign::Print(std::ostream* out) const {
  *out << systems << " systems: " << Count("right") << " right (" << directions << " directions, "
       << undecided << " more undecided), " << Count("refused") << " refused, " << Count("skipped")
       << " skipped, " << contradicted.size() << " contradicted\n";
  *out << "right, by generator:\n";
  for (const auto& [generator, number] : right) *out << "  " << number << " " << generator << "\n";
  for (const auto& [kind, reasons] : others) {
    *out << kind << ":\n";
    for (const auto& [reason, number] : reasons) {
      *out << "  " << number << " " << reason << " (first: seed " << first.at(kind).at(reason)
           << ")\n";
    }
  }
  for (const Finding& finding : contradicted) PrintFinding(finding, out);
}

Campaign RunCampaign(std::uint64_t first_seed, long systems, int threads) {
  Campaign campaign;
  campaign.systems = systems;
  std::atomic<long> next{0};
  std::mutex lock;
  long judged = 0;
  const auto work = [&] {
    for (long k = next++; k < systems; k = next++) {
      const std::uint64_t seed = first_seed + static_cast<std::uint64_t>(k);
      Verdict verdict;
      std::string generator;
      try {
        const Case c = GenerateWithOptions(seed);
        generator = c.generator;
        verdict = Judge(c);
      } catch (const std::exception& error) {
        verdict.kind = Verdict::Kind::kContradicted;
        verdict.reason = "exception";
        verdict.detail = error.what();
      }
      const std::lock_guard<std::mutex> guard(lock);
      if (++judged % kProgress == 0) {
        std::cerr << judged << " of " << systems << " judged, " << campaign.contradicted.size()
                  << " contradicted\n";
      }
      campaign.directions += verdict.directions;
      campaign.undecided += verdict.undecided;
      if (verdict.kind == Verdict::Kind::kRight) {
        ++campaign.right[generator];
        continue;
      }
      const std::string kind = Name(verdict.kind);
      const bool finding = verdict.kind == Verdict::Kind::kContradicted;
      const std::string reason = finding ? generator + ", " + verdict.reason : verdict.reason;
      ++campaign.others[kind][reason];
      const auto [place, added] = campaign.first[kind].emplace(reason, seed);
      if (!added) place->second = std::min(place->second, seed);
      if (finding) {
        campaign.contradicted.push_back({seed, generator, verdict.reason, verdict.detail});
        PrintFinding(campaign.contradicted.back(), &std::cerr);
      }
    }
  };
  std::vector<std::thread> pool;
  for (int k = 0; k < threads; ++k) pool.emplace_back(work);
  for (std::thread& thread : pool) thread.join();
  std::sort(campaign.contradicted.begin(), campaign.contradicted.end(),
            [](const auto& a, const auto& b) { return a.seed < b.seed; });
  return campaign;
}

}  // namespace adversary
}  // namespace contact_flow
