// A recording's file on a terminal of 80 columns.
#include <algorithm>
#include <array>
#include <cstdio>
#include <ctime>
#include <sstream>
#include <string>
#include <string_view>

#include "cli/recording_info.hpp"
#include "command_line/shell_word.hpp"
#include "evidence/recorded.hpp"
#include "rules/text/names.hpp"
#include "shm/utf8.hpp"

namespace arbiter::cli {
namespace {

using recording::McapTime;

constexpr std::size_t kColumns = 80;
constexpr std::size_t kMargin = 14;           // of what stands behind a heading
constexpr std::size_t kColumnsOfSchema = 30;  // a longer name stands over into the next column
constexpr McapTime kLogSecond = 1'000'000'000;
// A time before 1973 is not the time of day, but of a clock that began with the machine.
constexpr McapTime kFirstTimeOfDay = 100'000'000 * kLogSecond;

std::string formatted(const char* format, double number) {
  std::array<char, 64> text{};
  std::snprintf(text.data(), text.size(), format, number);
  return text.data();
}

std::string fraction_text(McapTime time) {
  const std::string digits = std::to_string(1'000 + time / 1'000'000 % 1'000);
  return "." + digits.substr(1);
}

std::string log_time_text(McapTime time) {
  const auto seconds = static_cast<std::time_t>(time / kLogSecond);
  std::tm local{};
  std::array<char, 64> text{};
  if (time < kFirstTimeOfDay || localtime_r(&seconds, &local) == nullptr ||
      std::strftime(text.data(), text.size(), "%F %T", &local) == 0) {
    return std::to_string(time / kLogSecond) + fraction_text(time) + " s of its clock";
  }
  std::array<char, 16> zone{};
  std::strftime(zone.data(), zone.size(), " %z", &local);
  return text.data() + fraction_text(time) + zone.data();
}

std::string length_text(McapTime length) {
  const McapTime seconds = length / kLogSecond;
  std::string text = std::to_string(seconds) + fraction_text(length) + " s";
  if (seconds < 60) return text;
  std::array<char, 64> clock{};
  std::snprintf(clock.data(), clock.size(), " (%llu:%02u:%02u)",
                static_cast<unsigned long long>(seconds / 3600),
                static_cast<unsigned>(seconds / 60 % 60), static_cast<unsigned>(seconds % 60));
  return text + clock.data();
}

std::string rate_text(double rate) { return formatted(rate < 1e6 ? "%.1f" : "%.2e", rate); }

std::string padded_to(std::string text, std::size_t columns) {
  if (text.size() < columns) text.append(columns - text.size(), ' ');
  return text;
}

std::string aligned_right(const std::string& text, std::size_t columns) {
  return std::string(columns - std::min(columns, text.size()), ' ') + text;
}

// Behind a heading, in as many lines as it takes.
void write_wrapped(std::ostream& out, const std::string& heading, const std::string& text) {
  std::istringstream words(text);
  std::string line = padded_to(heading, kMargin - 1);
  bool is_empty = true;
  for (std::string word; words >> word;) {
    if (!is_empty && line.size() + 1 + word.size() > kColumns) {
      out << line << '\n';
      line = std::string(kMargin - 1, ' ');
    }
    line += " " + word;
    is_empty = false;
  }
  out << line << '\n';
}

// In one line, which may leave something out.
std::string shortened(std::string_view value, std::size_t columns) {
  std::string text = shm::printable(value.substr(0, 4 * columns));
  if (text.size() <= columns && value.size() <= 4 * columns) return text;
  return std::string(shm::beginning_of(text, columns - 3)) + "...";
}

void write_state(std::ostream& out, const RecordingInfo& info) {
  if (info.end.is_whole) {
    write_wrapped(out, "state", info.end.has_summary ? "whole" : "whole, without a summary");
    return;
  }
  if (info.end.file_bytes == 0) {
    write_wrapped(out, "state", "the file is empty");
    return;
  }
  write_wrapped(
      out, "state",
      "not whole; what follows is in the first " + std::to_string(info.end.whole_bytes) + " bytes");
  write_wrapped(out, "problem", shm::printable(info.end.problem));
}

void write_times(std::ostream& out, const RecordingInfo& info) {
  if (!info.times) return;
  write_wrapped(out, "begin", log_time_text(info.times->begin));
  write_wrapped(out, "end", log_time_text(info.times->end));
  write_wrapped(out, "length", length_text(info.times->end - info.times->begin));
}

void write_chunks(std::ostream& out, const RecordingInfo& info) {
  std::string heading = "chunks";
  for (const auto& [compression, sum] : info.chunks) {
    std::string text = std::to_string(sum.count) + " of " +
                       (compression.empty() ? "no compression" : compression) + ", " +
                       size_text(sum.uncompressed);
    if (!compression.empty()) text += " in " + size_text(sum.compressed);
    write_wrapped(out, heading, text);
    heading.clear();
  }
}

void write_channels(std::ostream& out, const RecordingInfo& info) {
  if (info.channels.empty()) return;
  std::vector<const RecordingInfo::Channel*> channels;
  std::size_t columns = std::string_view("schema").size();
  const auto schema_of = [&](const RecordingInfo::Channel& channel) {
    const auto schema = info.schemas.find(channel.channel.schema);
    return schema == info.schemas.end() ? "-" : shm::printable(schema->second.name);
  };
  for (const auto& [id, channel] : info.channels) {
    channels.push_back(&channel);
    const std::size_t size = schema_of(channel).size();
    if (size <= kColumnsOfSchema) columns = std::max(columns, size);
  }
  std::stable_sort(channels.begin(), channels.end(), [](const auto* a, const auto* b) {
    return a->channel.topic < b->channel.topic;
  });
  out << "\n  messages        Hz  " << padded_to("schema", columns) << "  topic\n";
  for (const auto* channel : channels) {
    const auto rate = channel->rate();
    const std::string line = aligned_right(std::to_string(channel->messages), 10) +
                             aligned_right(rate ? rate_text(*rate) : "-", 10) + "  " +
                             padded_to(schema_of(*channel), columns);
    const std::string topic = shm::printable(channel->channel.topic);
    // Names are never cut: where both have no room in a line, the topic has one of its own.
    const bool has_room = line.size() + 2 + topic.size() <= kColumns;
    out << line << (has_room ? "  " : "\n" + std::string(24 + columns, ' ')) << topic << '\n';
  }
}

void write_imported_sources(std::ostream& out, const RecordingInfo& info) {
  if (!info.imports.empty()) out << "\nsources of other hosts\n";
  for (const auto& [source, hosts] : info.imports) {
    std::string text;
    for (const std::string& host : hosts) text += (text.empty() ? "  from " : ", ") + host;
    out << "  " << shm::printable(source + text) << '\n';
  }
}

void write_unrecorded_sources(std::ostream& out, const RecordingInfo& info) {
  if (!info.unrecorded.empty()) out << "\nsources that were not recorded, at least for a while\n";
  for (const auto& [source, each] : info.unrecorded) {
    out << "  " << shm::printable(source + ": " + each.text) << '\n';
  }
}

void write_metadata(std::ostream& out, const RecordingInfo& info) {
  for (const auto& [name, values] : info.metadata) {
    out << "\nmetadata " << shortened(name, kColumns - 9) << '\n';
    for (const auto& [key, value] : values) {
      const std::string text = "  " + shortened(key, 40) + " = ";
      out << text << shortened(value, kColumns - text.size()) << '\n';
    }
  }
}

void write_attachments(std::ostream& out, const RecordingInfo& info) {
  if (!info.attachments.empty()) out << "\nattachments\n";
  for (const auto& each : info.attachments) {
    out << aligned_right(size_text(each.bytes), 12) << "  "
        << padded_to(shortened(each.media_type, 20), 20) << "  " << shortened(each.name, 44)
        << '\n';
  }
  if (info.unlisted > 0) {
    out << "\nand " << info.unlisted
        << " more attachments, metadata records and sources of other hosts or not recorded\n";
  }
}

}  // namespace

std::string size_text(std::uint64_t bytes) {
  if (bytes < 10'000) return rules::counted(bytes, "byte");
  double size = static_cast<double>(bytes) / 1024;
  std::string_view unit = "KiB";
  for (const std::string_view larger : {"MiB", "GiB", "TiB"}) {
    if (size < 1000) break;
    size /= 1024;
    unit = larger;
  }
  return formatted("%.1f ", size) + std::string(unit);
}

void write_text(std::ostream& out, const RecordingInfo& info) {
  out << padded_to("file", kMargin) << shm::printable(info.path) << '\n';
  write_wrapped(out, "size", size_text(info.end.file_bytes));
  write_state(out, info);
  if (!info.library.empty()) write_wrapped(out, "written by", shm::printable(info.library));
  if (!info.profile.empty()) write_wrapped(out, "profile", shm::printable(info.profile));
  write_times(out, info);
  write_wrapped(out, "messages", std::to_string(info.messages));
  const std::string missed = evidence::missed_text(info.missed_events, info.missed_samples);
  if (!missed.empty()) {
    write_wrapped(out, "missed",
                  "by the recorder: " + missed +
                      "; what `simulate` and `export` tell around the gaps may be wrong");
  }
  write_chunks(out, info);
  write_channels(out, info);
  write_imported_sources(out, info);
  write_unrecorded_sources(out, info);
  write_metadata(out, info);
  write_attachments(out, info);
  if (info.end.is_whole || !info.has_header) return;
  out << "\nTo make a whole file of what is whole:\n  arbiter recording repair "
      << shm::printable(command_line::shell_word(info.path)) << '\n';
}

}  // namespace arbiter::cli
