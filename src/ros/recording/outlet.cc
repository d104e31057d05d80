// SPDX-License-Identifier: BSD-3-Clause
#include "outlet.h"

#include <algorithm>
#include <boost/date_time/posix_time/posix_time.hpp>
#include <cctype>
#include <utility>

#include "contact_flow/flow/status.h"

namespace contact_flow {
namespace ros_interface {

Outlet::Outlet(ros::NodeHandle* node, const std::string& bag_directory,
               const ModelDescription& description, std::shared_ptr<const SigningKey> key)
    : connections_(ros::this_node::getName()),
      recorder_(bag_directory),
      key_(std::move(key)),
      description_(description) {
  constexpr bool kLatch = true;
  model_description_ = node->advertise<ModelDescription>("model_description", 1, kLatch);
  ForEachResultTopic([&](const auto&, const auto& topic) {
    using Message = typename std::decay_t<decltype(topic)>::Message;
    results_[topic.name] = node->advertise<Message>(topic.name, 10, kLatch);
  });
  policy_ = node->advertise<Policy>("policy", 10, kLatch);
  description_.header.stamp = NextStamp();
  model_description_.publish(description_);
  writer_ = std::thread([this] { Run(); });
}

Outlet::~Outlet() {
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    stopping_ = true;
  }
  asked_.notify_one();
  writer_.join();
}

/// Now, but so much later than every stamp before that all messages of a result have times of their
/// own between; and never 0, which is what simulated time begins with.
ros::Time Outlet::NextStamp() {
  ros::Time now = ros::Time::now();
  if (now.isZero()) now.fromNSec(ros::WallTime::now().toNSec());
  last_stamp_ = std::max(now, last_stamp_ + ros::Duration(0, 1000));
  return last_stamp_;
}

void Outlet::Wait(Job* job, std::unique_lock<std::mutex>* lock) {
  jobs_.push_back(job);
  asked_.notify_one();
  done_.wait(*lock, [&] { return job->done; });
  if (job->error) std::rethrow_exception(job->error);
}

std::string Outlet::Hand(std::uint8_t outcome, Job* job, std::unique_lock<std::mutex>* lock) {
  if (!recording_) {
    if (job->publish) job->publish();
    return "";
  }
  // A run that was stopped half-way cannot be repeated, and nobody waits for its answer any more.
  if (outcome == static_cast<int>(Outcome::kCancelled)) job->result.entries.clear();
  Wait(job, lock);
  return job->path;
}

void Outlet::Run() {
  std::unique_lock<std::mutex> lock(mutex_);
  while (true) {
    asked_.wait(lock, [&] { return stopping_ || !jobs_.empty(); });
    if (jobs_.empty()) return;
    std::vector<Job*> jobs;
    jobs.swap(jobs_);
    lock.unlock();
    try {
      Carry(jobs);
    } catch (...) {  // out of memory
      for (Job* job : jobs) job->error = std::current_exception();
    }
    lock.lock();
    recording_ = recorder_.Recording();
    for (Job* job : jobs) job->done = true;
    done_.notify_all();
  }
}

/// Results that follow each other go to the disk together.
void Outlet::Carry(const std::vector<Job*>& jobs) {
  std::vector<Job*> together;
  for (Job* job : jobs) {
    try {
      if (!job->other) {
        together.push_back(job);
        continue;
      }
      WriteTogether(together);
      together.clear();
      job->other();
    } catch (...) {
      job->error = std::current_exception();
    }
  }
  WriteTogether(together);
}

void Outlet::WriteTogether(const std::vector<Job*>& jobs) {
  std::vector<Job*> written;
  try {
    std::vector<Recorder::Result> results;
    for (Job* job : jobs) {
      if (!recorder_.Recording() || job->result.entries.empty()) continue;
      results.push_back(job->result);
      written.push_back(job);
    }
    if (!results.empty()) recorder_.Write(results);
    for (Job* job : written) job->path = recorder_.Path();
  } catch (...) {
    if (jobs.size() > 1) {  // each by itself: some may fit
      for (Job* job : jobs) WriteTogether({job});
      return;
    }
    for (Job* job : jobs) job->error = std::current_exception();
  }
  for (Job* job : jobs) {
    if (job->error || !job->publish) continue;
    try {
      job->publish();
    } catch (...) {
      job->error = std::current_exception();
    }
  }
}

void Outlet::PublishMore(const PolicyRecord& record) {
  if (record.result.outcome != 0) return;  // there is none
  Policy policy = record.result.policy;
  policy.header = record.header;
  policy_.publish(policy);
}

std::string Outlet::StartRecording(const std::string& asked) {
  std::unique_lock<std::mutex> lock(mutex_);
  const ros::Time stamp = NextStamp();
  std::string name = asked;
  if (name.empty()) {
    std::string time = boost::posix_time::to_iso_extended_string(stamp.toBoost());
    std::replace(time.begin(), time.end(), ':', '-');
    name = description_.name + "_" + time;
    for (char& letter : name) {  // a robot may be called anything
      const bool plain = std::isalnum(static_cast<unsigned char>(letter)) || letter == '-';
      if (!plain) letter = '_';
    }
  }
  const auto description = boost::make_shared<const ModelDescription>(description_);
  RecordingPlan plan("results", ros::this_node::getName(), &connections_);
  std::vector<std::string> roles = ResultRoles();
  roles.insert(roles.begin(), "model_description");
  for (const std::string& role : roles) {
    plan.start.roles.push_back(role);
    plan.start.topics.push_back(ros::names::resolve("~" + role));
  }
  plan.key = key_;
  plan.preamble = {Entry("model_description", description)};
  Job job;
  job.other = [&] {
    recorder_.Start(name, plan, stamp);
    job.path = recorder_.Path();
  };
  Wait(&job, &lock);
  return job.path;
}

Recorder::Summary Outlet::StopRecording() {
  Recorder::Summary summary;
  Job job;
  job.other = [&] { summary = recorder_.Stop(); };
  std::unique_lock<std::mutex> lock(mutex_);
  Wait(&job, &lock);
  return summary;
}

}  // namespace ros_interface
}  // namespace contact_flow
