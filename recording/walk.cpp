#include "recording/walk.hpp"

#include <algorithm>
#include <memory>

#include "recording/compression.hpp"
#include "recording/crc32.hpp"
#include "recording/declarations.hpp"
#include "recording/input_file.hpp"

namespace arbiter::recording {
namespace {

constexpr std::uint64_t kFooterBytes = kHeadBytes + 8 + 8 + 4;

class Walk {
 public:
  Walk(const std::string& path, std::size_t max_bytes)
      : path_(path), file_(path), max_bytes_(max_bytes), declarations_(max_bytes) {}

  McapEnd run(const OnRecord& on_record, const Watch& watch);

 private:
  void read_magic();
  // The record at offset_, at which it stays; nothing of it has been judged but its length.
  Record read_record();
  void judge(const Record& record);
  std::string_view open_chunk(const Record& record);
  void pass(const Record& record);
  void read_data(const OnRecord& on_record, const Watch& watch);
  void read_data_end(const Record& record);
  void read_summary();
  void read_footer(const Record& record, std::uint64_t summary_at, std::uint32_t crc);

  std::string path_;
  InputFile file_;
  std::size_t max_bytes_;
  Declarations declarations_;
  std::unique_ptr<char[]> chunk_;  // the records of the last one
  std::size_t chunk_room_ = 0;
  std::uint64_t offset_ = 0;
  std::string reading_ = "the beginning of the file";  // what stands at offset_
  std::uint32_t crc_ = 0;                              // of all before offset_
  McapEnd end_;
};

void Walk::read_magic() {
  if (file_.size() == 0) throw Damage{"the file is empty"};
  const std::size_t count = std::min<std::uint64_t>(file_.size(), kMagic.size());
  const std::string_view found = file_.read(0, count);
  constexpr std::size_t kVersionAt = 5;
  if (count > kVersionAt && found.substr(0, kVersionAt) == kMagic.substr(0, kVersionAt) &&
      found[kVersionAt] != kMagic[kVersionAt]) {
    throw McapError("cannot read " + path_ +
                    ": it is an MCAP file of another version than 0, the only one that this "
                    "program knows");
  }
  if (found != kMagic.substr(0, count)) {
    throw McapError("cannot read " + path_ + ": it is not an MCAP file, by its first bytes");
  }
  if (count < kMagic.size()) throw Damage{"the file ends within it"};
  crc_ = crc32(found);
  offset_ = count;
  end_.whole_bytes = offset_;
}

Record Walk::read_record() {
  const std::uint64_t left = file_.size() - offset_;
  reading_ = left == 0 ? "the end of the file" : "what should be a record";
  if (left == 0) throw Damage{"there is no footer: its writer was stopped, or still writes"};
  if (left < kHeadBytes) throw Damage{"the file ends within it"};
  ByteReader head(file_.read(offset_, kHeadBytes));
  const auto opcode = static_cast<Opcode>(head.number<std::uint8_t>());
  const auto length = head.number<std::uint64_t>();
  reading_ = "the " + name_of(opcode);
  if (length > left - kHeadBytes) {
    throw Damage{"it says that it has " + std::to_string(length) + " bytes, and the file ends " +
                 std::to_string(left - kHeadBytes) + " bytes after its head"};
  }
  if (length > max_bytes_) {
    throw Damage{"it has " + std::to_string(length) + " bytes, more than the " +
                 std::to_string(max_bytes_) + " that this program reads"};
  }
  if (static_cast<std::uint8_t>(opcode) == 0) throw Damage{"there is no record of kind 0"};
  return {opcode, offset_, file_.read(offset_, kHeadBytes + length)};
}

std::string_view Walk::open_chunk(const Record& record) {
  const ChunkHead head = read_chunk_head(record.content());
  if (head.bytes > max_bytes_) {
    throw Damage{"it says that it has " + std::to_string(head.bytes) +
                 " bytes when decompressed, more than the " + std::to_string(max_bytes_) +
                 " that this program reads"};
  }
  if (head.bytes > chunk_room_) {
    // Not filled: of what a chunk merely claims, the system need not find the memory.
    chunk_.reset(new char[head.bytes]);
    chunk_room_ = head.bytes;
  }
  decompress(compression_of(head.compression), head.records, chunk_.get(), head.bytes);
  const std::string_view records(chunk_.get(), head.bytes);
  if (head.crc != 0 && head.crc != crc32(records)) {
    throw Damage{"its records do not have the CRC that it says"};
  }
  RecordCursor cursor(records);
  while (const auto inner = cursor.next()) {
    switch (inner->opcode) {
      case Opcode::schema:
      case Opcode::channel:
      case Opcode::message:
        declarations_.judge(*inner);
        break;
      default:
        if (static_cast<std::uint8_t>(inner->opcode) >
            static_cast<std::uint8_t>(Opcode::data_end)) {
          break;
        }
        throw Damage{"it contains a " + name_of(inner->opcode) + ", which no chunk may"};
    }
  }
  return records;
}

// All but chunks.
void Walk::judge(const Record& record) {
  switch (record.opcode) {
    case Opcode::schema:
    case Opcode::channel:
    case Opcode::message:
      declarations_.judge(record);
      break;
    case Opcode::attachment:
      (void)read_attachment(record.content());
      break;
    case Opcode::metadata:
      (void)read_metadata(record.content());
      break;
    case Opcode::header:
      if (record.offset != kMagic.size()) throw Damage{"a file has only one"};
      (void)read_header(record.content());
      break;
    case Opcode::footer:
    case Opcode::chunk_index:
    case Opcode::attachment_index:
    case Opcode::statistics:
    case Opcode::metadata_index:
    case Opcode::summary_offset:
      throw Damage{"it stands before the end of the data"};
    default:  // message indexes say what the chunk says; others are for other programs
      break;
  }
}

void Walk::pass(const Record& record) {
  crc_ = crc32(record.bytes, crc_);
  offset_ += record.bytes.size();
  end_.whole_bytes = offset_;
}

void Walk::read_data(const OnRecord& on_record, const Watch& watch) {
  while (true) {
    if (watch) watch(offset_, file_.size());
    const Record record = read_record();
    if (record.offset == kMagic.size() && record.opcode != Opcode::header) {
      throw Damage{"a file begins with a header"};
    }
    if (record.opcode == Opcode::data_end) return read_data_end(record);
    std::string_view records;
    if (record.opcode == Opcode::chunk) {
      records = open_chunk(record);
    } else {
      judge(record);
    }
    pass(record);
    on_record(record, records);
  }
}

void Walk::read_data_end(const Record& record) {
  const auto crc = ByteReader(record.content()).number<std::uint32_t>();
  if (crc != 0 && crc != crc_) {
    throw Damage{
        "the CRC of all before it is another: outside of chunks, whose CRCs are right, there is "
        "a byte that was not written so"};
  }
  pass(record);
}

void Walk::read_summary() {
  const std::uint64_t summary_at = offset_;
  std::uint32_t crc = 0;
  while (true) {
    const Record record = read_record();
    if (record.opcode == Opcode::footer) return read_footer(record, summary_at, crc);
    crc = crc32(record.bytes, crc);
    pass(record);
  }
}

void Walk::read_footer(const Record& record, std::uint64_t summary_at, std::uint32_t crc) {
  if (record.bytes.size() != kFooterBytes) throw Damage{"it does not have a footer's length"};
  ByteReader reader(record.content());
  const auto says_summary_at = reader.number<std::uint64_t>();
  (void)reader.number<std::uint64_t>();
  const auto says_crc = reader.number<std::uint32_t>();
  const bool has_summary = record.offset > summary_at;
  if (says_summary_at != summary_at && (has_summary || says_summary_at != 0)) {
    throw Damage{"it says that the summary begins at byte " + std::to_string(says_summary_at) +
                 ", and the data end at byte " + std::to_string(summary_at)};
  }
  crc = crc32(record.bytes.substr(0, record.bytes.size() - sizeof says_crc), crc);
  if (says_crc != 0 && says_crc != crc) throw Damage{"the summary does not have the CRC it says"};
  pass(record);
  reading_ = "what should end the file";
  const std::uint64_t left = file_.size() - offset_;
  if (left < kMagic.size() || file_.read(offset_, kMagic.size()) != kMagic) {
    throw Damage{"the eight bytes that end an MCAP file are not there"};
  }
  offset_ += kMagic.size();
  if (left > kMagic.size()) {
    throw Damage{"there are " + std::to_string(left - kMagic.size()) + " bytes behind it"};
  }
  end_.whole_bytes = offset_;
  end_.has_summary = has_summary && says_summary_at != 0;
}

McapEnd Walk::run(const OnRecord& on_record, const Watch& watch) {
  end_.file_bytes = file_.size();
  try {
    read_magic();
    read_data(on_record, watch);
    read_summary();
  } catch (const Damage& damage) {
    end_.is_whole = false;
    end_.problem = "at byte " + std::to_string(offset_) + ", " + reading_ + ": " + damage.what;
  }
  return end_;
}

}  // namespace

McapEnd walk_mcap(const std::string& path, std::size_t max_bytes, const OnRecord& on_record,
                  const Watch& watch) {
  return Walk(path, max_bytes).run(on_record, watch);
}

}  // namespace arbiter::recording
