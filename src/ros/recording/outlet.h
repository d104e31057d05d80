// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <ros/ros.h>

#include <condition_variable>
#include <exception>
#include <functional>
#include <map>
#include <memory>
#include <mutex>
#include <string>
#include <thread>
#include <tuple>
#include <utility>
#include <vector>

#include "contact_flow/ModelDescription.h"
#include "record_types.h"
#include "recorder.h"

namespace contact_flow {
namespace ros_interface {

/// Where results go, in the order of their stamps: first to the bag, then to the latched topics.
/// May be used by several threads at once: what they deliver while the disk is busy is written
/// together next.
class Outlet {
 public:
  /// Publishes the model on `model_description`, too.
  Outlet(ros::NodeHandle* node, const std::string& bag_directory,
         const ModelDescription& description, std::shared_ptr<const SigningKey> key = nullptr);
  ~Outlet();

  /// Stamps a record of record_types.h, writes it to the bag if recording is on, publishes what is
  /// made of its result, and returns the path of the bag, or "". Throws std::runtime_error when the
  /// result could not be written; it is not published then.
  template <class Record>
  std::string Deliver(Record* record);

  /// As Recorder; an empty name is made of the model and the time. Returns the path.
  std::string StartRecording(const std::string& name);
  Recorder::Summary StopRecording();

 private:
  ros::Time NextStamp();
  /// Something that the writer is to do; it is told under the mutex when it is done.
  struct Job {
    Recorder::Result result;
    std::function<void()> publish;  // behind it
    std::function<void()> other;    // instead of a result
    std::string path;
    std::exception_ptr error;
    bool done = false;
  };

  /// Stamps both, the record and its copy that is delivered.
  template <class Record>
  void Stamp(Record* record, Record* shared);
  /// With the mutex locked by the caller. Throws the job's error.
  void Wait(Job* job, std::unique_lock<std::mutex>* lock);
  std::string Hand(std::uint8_t outcome, Job* job, std::unique_lock<std::mutex>* lock);
  void Run();
  void Carry(const std::vector<Job*>& jobs);
  void WriteTogether(const std::vector<Job*>& jobs);
  /// The message of an ordinary topic, to be stamped: of the result in `record`, or that itself.
  template <class Record, class Topic>
  static auto MessageOf(const Topic& topic, const boost::shared_ptr<Record>& record);
  template <class Message>
  BagEntry Entry(const std::string& topic, boost::shared_ptr<const Message> message);
  /// What is published besides, and not recorded.
  template <class Record>
  void PublishMore(const Record&) {}
  void PublishMore(const PolicyRecord& record);

  std::mutex mutex_;
  std::condition_variable asked_, done_;
  std::vector<Job*> jobs_;  // for the writer, in the order of their stamps
  bool recording_ = false;
  bool stopping_ = false;
  ros::Time last_stamp_;
  BagConnections connections_;
  Recorder recorder_;  // of the writer
  const std::shared_ptr<const SigningKey> key_;
  ModelDescription description_;
  ros::Publisher model_description_;
  std::map<std::string, ros::Publisher> results_;  // by the names of ResultTopics
  ros::Publisher policy_;
  std::thread writer_;
};

template <class Record>
void Outlet::Stamp(Record* record, Record* shared) {
  record->header.stamp = NextStamp();
  record->header.frame_id = kWorldFrame;
  record->result.header = record->header;
  shared->header = shared->result.header = record->header;
}

template <class Message>
BagEntry Outlet::Entry(const std::string& topic, boost::shared_ptr<const Message> message) {
  return connections_.Entry(ros::names::resolve("~" + topic), std::move(message));
}

template <class Record, class Topic>
auto Outlet::MessageOf(const Topic& topic, const boost::shared_ptr<Record>& record) {
  using Message = typename Topic::Message;
  if constexpr (std::is_same_v<Message, typename Record::_result_type>) {
    if (topic.of == nullptr) return boost::shared_ptr<Message>(record, &record->result);
  }
  return boost::make_shared<Message>(topic.Of(record->result));
}

template <class Record>
std::string Outlet::Deliver(Record* record) {
  const auto& type = RecordTypeOf<Record>();
  const auto shared = boost::make_shared<Record>(*record);
  std::vector<std::function<void()>> stamp, publish;
  std::vector<std::function<BagEntry()>> entries;
  const auto add = [&](const auto& topic) {
    using Message = typename std::decay_t<decltype(topic)>::Message;
    const auto message = MessageOf(topic, shared);
    const char* const name = topic.name;
    stamp.push_back([=] { message->header = record->header; });
    publish.push_back([this, name, message] { results_.at(name).publish(message); });
    entries.push_back([this, name, message] { return Entry<Message>(name, message); });
  };
  std::apply([&](const auto&... topic) { (add(topic), ...); }, type.topics);
  Job job;
  job.publish = [&] {
    for (const auto& one : publish) one();
  };
  std::string path;
  {
    std::unique_lock<std::mutex> lock(mutex_);
    Stamp(record, shared.get());
    for (const auto& one : stamp) one();
    job.result = {{Entry<Record>(type.Role(), shared)}, record->header.stamp};
    for (const auto& one : entries) job.result.entries.push_back(one());
    path = Hand(shared->result.outcome, &job, &lock);
  }
  PublishMore(*record);
  return path;
}

}  // namespace ros_interface
}  // namespace contact_flow
