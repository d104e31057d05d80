// SPDX-License-Identifier: BSD-3-Clause
#include "bag_reader.h"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <map>
#include <set>
#include <utility>

#include "bag_records.h"

namespace contact_flow {
namespace ros_interface {
namespace {

using bag_records::Broken;
using bag_records::Cursor;
using bag_records::Fields;
using bag_records::Next;
using bag_records::Record;

class Reader {
 public:
  explicit Reader(const std::string& bytes) : bytes_(bytes) {}

  BagContent Read() {
    Begin();
    Cursor body(bytes_, cursor_.position(), content_.closed ? index_position_ : bytes_.size());
    while (!body.done()) {
      const std::size_t at = body.position();
      try {
        Body(Next(&body));
      } catch (const Broken&) {
        if (content_.closed) throw;
        content_.cut_at = at;
        return std::move(content_);
      }
    }
    if (!content_.closed) return std::move(content_);
    EndChunk(bytes_.size(), true);
    Index(Cursor(bytes_, index_position_, bytes_.size()));
    return std::move(content_);
  }

 private:
  using Entry = std::pair<ros::Time, std::uint32_t>;  // time and offset in the chunk
  struct Chunk {
    std::size_t position;
    ros::Time begin, end;
    std::map<std::uint32_t, std::uint32_t> counts;  // of messages, by connection
  };

  void Begin() {
    const std::size_t length = sizeof(kBagVersion) - 1;
    if (bytes_.compare(0, length, kBagVersion) != 0) {
      throw DamagedBag(0, "it does not begin with #ROSBAG V2.0");
    }
    cursor_.Skip(length, "the version");
    const std::size_t at = cursor_.position();
    const Record head = Next(&cursor_);
    if (head.op != BagOp::kFileHeader) throw DamagedBag(at, "no bag header");
    if (cursor_.position() - at != kBagHeaderSize + 8)
      throw DamagedBag(at, "a header of another size");
    const std::string padding = Cursor(head.data).Rest();
    const std::size_t odd = padding.find_first_not_of(' ');
    if (odd != std::string::npos) throw DamagedBag(head.data.position() + odd, "not a space");
    const auto index = head.Get<std::uint64_t>("index_pos");
    connection_count_ = head.Get<std::uint32_t>("conn_count");
    chunk_count_ = head.Get<std::uint32_t>("chunk_count");
    content_.closed = index != 0;
    index_position_ = static_cast<std::size_t>(index);
    if (content_.closed && (index < cursor_.position() || index > bytes_.size())) {
      throw DamagedBag(std::min(bytes_.size(), at),
                       "its index is at byte " + std::to_string(index) + ", outside of the file");
    }
    if (!content_.closed && (connection_count_ != 0 || chunk_count_ != 0)) {
      throw DamagedBag(at, "counts without an index");
    }
  }

  void Body(const Record& record) {
    if (record.op == BagOp::kChunk) {
      EndChunk(record.position, false);
      ReadChunk(record);
    } else if (record.op == BagOp::kIndexData) {
      const auto id = record.Get<std::uint32_t>("conn");
      const auto found = to_index_.find(id);
      if (found == to_index_.end()) throw DamagedBag(record.position, "an index of no message");
      Cursor data = record.data;
      const auto count = record.Get<std::uint32_t>("count");
      if (data.size() != std::size_t{count} * 12)
        throw DamagedBag(record.position, "an index is cut");
      std::vector<Entry> entries;
      while (!data.done()) {
        const ros::Time time = record.TimeOf(data.Take<std::uint64_t>("a time"));
        entries.emplace_back(time, data.Take<std::uint32_t>("an offset"));
      }
      std::sort(entries.begin(), entries.end());
      std::sort(found->second.begin(), found->second.end());
      if (entries != found->second) throw DamagedBag(record.position, "an index of other messages");
      to_index_.erase(found);
    } else {
      throw DamagedBag(record.position, "a record that does not belong here");
    }
  }

  /// The last chunk of a bag that was indexed anew is not followed by its index.
  void EndChunk(std::size_t position, bool last) {
    if (!to_index_.empty() && !last) throw DamagedBag(position, "the chunk before has no index");
  }

  void ReadChunk(const Record& record) {
    if (record.header.at("compression") != "none") {
      throw std::runtime_error("chunks are compressed: undo that first (rosbag decompress)");
    }
    if (record.Get<std::uint32_t>("size") != record.data.size()) {
      throw DamagedBag(record.position, "a chunk of another size than it says");
    }
    Chunk chunk{record.position, {}, {}, {}};
    to_index_.clear();
    Cursor cursor = record.data;
    while (!cursor.done()) {
      const std::size_t at = cursor.position();
      const Record inner = Whole(&cursor);
      if (inner.op == BagOp::kConnection) {
        Connect(inner);
      } else if (inner.op == BagOp::kMessage) {
        const auto id = inner.Get<std::uint32_t>("conn");
        const auto connection = connections_.find(id);
        if (connection == connections_.end()) throw DamagedBag(at, "a message of no connection");
        const ros::Time time = inner.Time("time");
        content_.messages.push_back({connection->second, time,
                                     reinterpret_cast<const std::uint8_t*>(inner.data.data()),
                                     inner.data.size()});
        const auto offset = static_cast<std::uint32_t>(at - record.data.position());
        to_index_[id].emplace_back(time, offset);
        chunk.begin = chunk.counts.empty() ? time : std::min(chunk.begin, time);
        chunk.end = std::max(chunk.end, time);
        ++chunk.counts[id];
      } else {
        throw DamagedBag(at, "a record that does not belong into a chunk");
      }
    }
    if (chunk.counts.empty()) throw DamagedBag(record.position, "a chunk without messages");
    chunks_.push_back(std::move(chunk));
  }

  /// A record that is there as a whole, since what is around it is.
  static Record Whole(Cursor* cursor) {
    try {
      return Next(cursor);
    } catch (const Broken& error) {
      throw DamagedBag(error);
    }
  }

  void Connect(const Record& record) {
    const auto id = record.Get<std::uint32_t>("conn");
    BagFields fields;
    try {
      fields = Fields(record.data);
    } catch (const Broken& error) {
      throw DamagedBag(error);
    }
    fields.emplace("topic", record.header.at("topic"));  // rosbag does not say it twice
    for (const char* name : {"type", "md5sum", "message_definition"}) {
      if (!fields.count(name))
        throw DamagedBag(record.position, std::string("a connection without ") + name);
    }
    if (fields.at("topic") != record.header.at("topic")) {
      throw DamagedBag(record.position, "a connection of two topics");
    }
    const auto known = connections_.find(id);
    if (known == connections_.end()) {
      connections_[id] = std::make_shared<const BagFields>(std::move(fields));
    } else if (*known->second != fields) {
      throw DamagedBag(record.position, "a connection that was another before");
    }
  }

  void Index(Cursor cursor) {
    std::set<std::uint32_t> listed;
    std::size_t chunks = 0;
    while (!cursor.done()) {
      const Record record = Whole(&cursor);
      if (record.op == BagOp::kConnection && chunks == 0) {
        const auto id = record.Get<std::uint32_t>("conn");
        if (!connections_.count(id))
          throw DamagedBag(record.position, "a connection without messages");
        Connect(record);
        if (!listed.insert(id).second) throw DamagedBag(record.position, "a connection twice");
      } else if (record.op == BagOp::kChunkInfo) {
        CheckInfo(record, chunks++);
      } else {
        throw DamagedBag(record.position, "a record that does not belong into an index");
      }
    }
    if (listed.size() != connections_.size() || chunks != chunks_.size() ||
        connection_count_ != listed.size() || chunk_count_ != chunks) {
      throw DamagedBag(index_position_, "an index of other connections or chunks");
    }
  }

  void CheckInfo(const Record& record, std::size_t number) const {
    if (number >= chunks_.size()) throw DamagedBag(record.position, "an index of no chunk");
    const Chunk& chunk = chunks_[number];
    Cursor data = record.data;
    std::map<std::uint32_t, std::uint32_t> counts;
    const auto count = record.Get<std::uint32_t>("count");
    if (data.size() != std::size_t{count} * 8) throw DamagedBag(record.position, "an index is cut");
    while (!data.done()) {
      const auto id = data.Take<std::uint32_t>("a connection");
      counts[id] += data.Take<std::uint32_t>("a count");
    }
    if (counts.size() != count || counts != chunk.counts ||
        record.Get<std::uint64_t>("chunk_pos") != chunk.position ||
        record.Time("start_time") != chunk.begin || record.Time("end_time") != chunk.end) {
      throw DamagedBag(record.position, "an index of another chunk");
    }
  }

  const std::string& bytes_;
  Cursor cursor_{bytes_, 0, bytes_.size()};
  std::size_t index_position_ = 0;
  std::uint32_t connection_count_ = 0, chunk_count_ = 0;
  std::map<std::uint32_t, BagConnection> connections_;
  std::map<std::uint32_t, std::vector<Entry>> to_index_;  // of the last chunk, by connection
  std::vector<Chunk> chunks_;
  BagContent content_;
};

}  // namespace

DamagedBag::DamagedBag(std::size_t position, const std::string& reason)
    : std::runtime_error("damaged at byte " + std::to_string(position) + ": " + reason) {}

BagContent ReadBag(const std::string& bytes) { return Reader(bytes).Read(); }

std::string ReadRegularFile(const std::string& path) {
  const auto fail = [&] { throw std::runtime_error(std::strerror(errno)); };
  const int fd = ::open(path.c_str(), O_RDONLY | O_NONBLOCK | O_CLOEXEC);
  if (fd < 0) fail();
  struct stat status;
  std::string bytes;
  ssize_t n = ::fstat(fd, &status);
  const bool regular = n == 0 && S_ISREG(status.st_mode);
  if (regular) {
    bytes.resize(static_cast<std::size_t>(status.st_size));
    std::size_t size = 0;
    while (size < bytes.size() && (n = ::read(fd, &bytes[size], bytes.size() - size)) > 0) {
      size += static_cast<std::size_t>(n);
    }
    bytes.resize(size);
  }
  ::close(fd);
  if (n < 0) fail();
  if (!regular) throw std::runtime_error("not a regular file");
  return bytes;
}

}  // namespace ros_interface
}  // namespace contact_flow
