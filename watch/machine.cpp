#include "watch/machine.hpp"

#include <unistd.h>

#include <algorithm>
#include <array>
#include <charconv>
#include <filesystem>
#include <fstream>
#include <string_view>
#include <system_error>

namespace arbiter::watch {
namespace {

namespace fs = std::filesystem;

constexpr std::size_t kMostBytes = 65'536;

std::optional<std::uint64_t> number_at(std::string_view text, int base) {
  text.remove_prefix(std::min(text.find_first_not_of(" \t"), text.size()));
  std::uint64_t value = 0;
  const auto read = std::from_chars(text.data(), text.data() + text.size(), value, base);
  return read.ec == std::errc() ? std::optional(value) : std::nullopt;
}

// What stands behind the name, in the line that begins with it.
std::optional<std::string_view> rest_of_line(std::string_view text, std::string_view name) {
  while (!text.empty()) {
    const std::string_view line = text.substr(0, text.find('\n'));
    if (line.starts_with(name)) return line.substr(name.size());
    text.remove_prefix(std::min(line.size() + 1, text.size()));
  }
  return std::nullopt;
}

}  // namespace

std::string host_name() {
  std::array<char, 256> name{};
  if (::gethostname(name.data(), name.size() - 1) != 0) return {};
  return name.data();
}

std::optional<std::string> Machine::read(const std::string& path) const {
  std::ifstream file(root_ + path, std::ios::binary);
  if (!file) return std::nullopt;
  std::string text(kMostBytes, '\0');
  file.read(text.data(), static_cast<std::streamsize>(text.size()));
  if (file.bad()) return std::nullopt;
  text.resize(static_cast<std::size_t>(file.gcount()));
  text.resize(text.find_last_not_of(" \t\n") + 1);
  return text;
}

std::optional<std::string> Machine::read_link(const std::string& path) const {
  std::error_code error;
  const fs::path target = fs::read_symlink(root_ + path, error);
  return error ? std::nullopt : std::optional(target.string());
}

bool Machine::has_process(std::int32_t pid) const {
  std::error_code error;
  return root_.empty() || fs::exists(root_ + "/proc/" + std::to_string(pid), error);
}

std::vector<std::string> Machine::list(const std::string& directory) const {
  std::vector<std::string> names;
  std::error_code error;
  for (fs::directory_iterator entry(root_ + directory, error), end; !error && entry != end;
       entry.increment(error)) {
    names.push_back(entry->path().filename().string());
  }
  std::sort(names.begin(), names.end());
  return names;
}

std::optional<std::uint64_t> Machine::field(const std::string& path, const std::string& name,
                                            int base) const {
  const auto text = read(path);
  if (!text) return std::nullopt;
  const auto rest = rest_of_line(*text, name + ":");
  return rest ? number_at(*rest, base) : std::nullopt;
}

// "Max open files            1024                 524288               files".
std::optional<std::uint64_t> Machine::limit(const std::string& process,
                                            const std::string& name) const {
  const auto text = read("/proc/" + process + "/limits");
  if (!text) return std::nullopt;
  auto rest = rest_of_line(*text, name + " ");
  if (!rest) return std::nullopt;
  rest->remove_prefix(std::min(rest->find_first_not_of(' '), rest->size()));
  return rest->starts_with("unlimited") ? std::optional(kUnlimited) : number_at(*rest, 10);
}

bool Machine::has_capability(const std::string& process, Capability capability) const {
  const auto set = field("/proc/" + process + "/status", "CapEff", 16);
  return set && (*set >> static_cast<unsigned>(capability) & 1) != 0;
}

// "pid (name) state …".
bool Machine::is_stopped(const std::string& process) const {
  const auto text = read("/proc/" + process + "/stat").value_or("");
  const auto end = text.rfind(") ");
  return end != std::string::npos && end + 2 < text.size() &&
         (text[end + 2] == 'T' || text[end + 2] == 't');
}

}  // namespace arbiter::watch
