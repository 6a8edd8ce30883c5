// What stands at the end of a file: the schemas and channels again, statistics, and where
// everything is. Made from what is written, as it is written.
#pragma once

#include <cstdint>
#include <map>
#include <string>
#include <string_view>
#include <vector>

#include "recording/mcap.hpp"
#include "recording/mcap_chunk.hpp"
#include "recording/records.hpp"

namespace arbiter::recording {

class Summary {
 public:
  // Each is said once it stands in the file, at `offset`. `record`: all its bytes.
  void add_schema(std::uint16_t id, std::string_view record);
  void add_channel(std::uint16_t id, std::string_view record);
  void add_chunk(std::uint64_t offset, const McapChunk& chunk);
  void add_message(std::uint16_t channel, McapTime log_time);  // outside of chunks
  void add_metadata(std::uint64_t offset, std::string_view record);
  void add_attachment(std::uint64_t offset, std::string_view record);

  // From the end of the data section, at `offset`, to the end of the file. `crc`: of all before.
  [[nodiscard]] std::string ending(std::uint64_t offset, std::uint32_t crc) const;

 private:
  void add_times(McapTime begin, McapTime end);
  [[nodiscard]] std::string statistics() const;

  std::map<std::uint16_t, std::string> schemas_;
  std::map<std::uint16_t, std::string> channels_;
  std::string chunk_indexes_;
  std::string attachment_indexes_;
  std::string metadata_indexes_;
  std::map<std::uint16_t, std::uint64_t> counts_;
  std::uint64_t messages_ = 0;
  std::uint32_t chunks_ = 0;
  std::uint32_t attachments_ = 0;
  std::uint32_t metadata_ = 0;
  McapTime begin_ = 0;
  McapTime end_ = 0;
};

}  // namespace arbiter::recording
