// A file's data section, record by record, each judged before it is passed on: whatever the file
// claims, what comes out of here is consistent.
#pragma once

#include <cstddef>
#include <functional>
#include <string>
#include <string_view>

#include "recording/mcap.hpp"
#include "recording/records.hpp"

namespace arbiter::recording {

// One of the data section, but its end, and of kinds that this program does not know as well.
// `records`: of a chunk, decompressed; valid until it returns, as the record is.
using OnRecord = std::function<void(const Record& record, std::string_view records)>;

// As read_mcap().
McapEnd walk_mcap(const std::string& path, std::size_t max_bytes, const OnRecord& on_record,
                  const Watch& watch);

}  // namespace arbiter::recording
