#include "gateway/dds/domain.hpp"

#include <dds/ddsrt/log.h>
#include <dds/features.h>

#include <algorithm>
#include <cstdlib>
#include <string_view>
#include <system_error>

#include "gateway/core/say.hpp"
#include "gateway/dds/quota.hpp"
#include "gateway/dds/repeats.hpp"
#include "gateway/dds/steady_waits.hpp"
#include "shm/clock.hpp"
#include "shm/memory_file.hpp"

namespace arbiter::gateway::dds {
namespace {

// Of participants on one host that find each other without multicast, and of those on a peer. Each
// costs a datagram now and then.
constexpr int kMaxParticipants = 32;

bool is_address(const std::string& interface) {
  return interface.find_first_not_of("0123456789.") == std::string::npos ||
         interface.find(':') != std::string::npos;
}

// Of this thread: where CycloneWords keeps them; null: nowhere.
thread_local std::vector<std::string>* kept_words = nullptr;
constexpr std::size_t kMaxKept = 32;

bool is_loopback(const std::string& interface) {
  return interface == "lo" || interface.starts_with("127.") || interface == "::1";
}

// The mapping's own configuration, as it was when the mapping was read: Cyclone reads it when the
// domain is joined, perhaps long after, and would go by what stands there then.
class ConfigurationFile {
 public:
  explicit ConfigurationFile(const Gateway& gateway) : name_(gateway.configuration) {
    if (name_.empty()) return;
    memory_ = shm::memory_file("arbiter-cyclonedds", gateway.configuration_text);
    path_ = "/proc/self/fd/" + std::to_string(memory_.get());
    handed_over = this;
  }
  ConfigurationFile(const ConfigurationFile&) = delete;
  ConfigurationFile& operator=(const ConfigurationFile&) = delete;
  ~ConfigurationFile() { handed_over = nullptr; }

  // Empty: there is none.
  [[nodiscard]] const std::string& path() const { return path_; }

  // In what Cyclone says while this thread hands it such a file, the file has its own name.
  static void name_in(std::string& words) {
    if (handed_over == nullptr) return;
    const std::size_t at = words.find(handed_over->path_);
    if (at != words.npos) words.replace(at, handed_over->path_.size(), handed_over->name_);
  }

 private:
  static thread_local const ConfigurationFile* handed_over;

  const std::string name_;
  std::string path_;
  shm::FileDescriptor memory_;
};

thread_local const ConfigurationFile* ConfigurationFile::handed_over = nullptr;

// Cyclone waits a minute for RouDi, which need not run, and then ends the process. Nodes that use
// its shared memory are reached by the network, too.
#ifdef DDS_HAS_SHM
constexpr std::string_view kNoSharedMemory = "<SharedMemory><Enable>false</Enable></SharedMemory>";
#else
constexpr std::string_view kNoSharedMemory;
#endif

// Only where a file may say otherwise, or the text does: Cyclone closes elements that the end of a
// text leaves open, and what stands behind them would be in them.
bool may_have_shared_memory(const std::string& configuration) {
  return configuration.find("file://") != std::string::npos ||
         configuration.find("SharedMemory") != std::string::npos;
}

Entity open_domain(dds_domainid_t id, const Gateway& gateway) try {
  const ConfigurationFile file(gateway);
  std::string text = configuration_of(gateway, file.path());
  if (!kNoSharedMemory.empty() && may_have_shared_memory(text)) {
    text += "," + std::string(kNoSharedMemory);
  }
  return {dds_create_domain(id, text.c_str()), "domain " + std::to_string(id)};
} catch (const std::system_error& error) {  // no memory for the file
  throw DdsError(error.what());
}

Entity join(dds_domainid_t domain) {
  const CycloneQos qos(dds_create_qos());
  dds_qset_userdata(qos.get(), kOfGateway.data(), kOfGateway.size());
  return {dds_create_participant(domain, qos.get(), nullptr),
          "a participant in domain " + std::to_string(domain)};
}

}  // namespace

std::string escaped(const std::string& text) {
  std::string result;
  for (const char c : text) {
    switch (c) {
      case '&':
        result += "&amp;";
        break;
      case '<':
        result += "&lt;";
        break;
      case '>':
        result += "&gt;";
        break;
      case '"':
        result += "&quot;";
        break;
      case '$':
        result += "&#36;";
        break;  // Cyclone puts variables of the environment there
      default:
        result += c;
    }
  }
  return result;
}

dds_domainid_t domain_of(const Gateway& gateway) {
  if (gateway.domain) return *gateway.domain;
  const auto domain = domain_of_environment();
  if (domain) return *domain;
  throw DdsError("ROS_DOMAIN_ID is \"" + std::string(std::getenv("ROS_DOMAIN_ID")) +
                 "\": it must be a number from 0 to " + std::to_string(kMaxDomain));
}

std::string configuration_of(const Gateway& gateway, const std::string& file) {
  std::string result;
  if (!file.empty()) result = "file://" + file;
  if (gateway.interfaces.empty() && gateway.peers.empty()) {
    const char* const uri = std::getenv("CYCLONEDDS_URI");
    return result.empty() && uri != nullptr ? uri : result;
  }
  bool only_loopback = !gateway.interfaces.empty();
  std::string interfaces;
  for (const std::string& interface : gateway.interfaces) {
    only_loopback = only_loopback && is_loopback(interface);
    interfaces += std::string("<NetworkInterface ") + (is_address(interface) ? "address" : "name") +
                  "=\"" + escaped(interface) + "\"/>";
  }
  std::string text;
  if (!interfaces.empty()) {
    text += "<General><Interfaces>" + interfaces + "</Interfaces>";
    // The loopback interface has none; participants are looked for at its address instead.
    if (only_loopback) text += "<AllowMulticast>false</AllowMulticast>";
    text += "</General>";
  }
  if (only_loopback || !gateway.peers.empty()) {
    // Otherwise they listen where nobody looks for them.
    text += "<Discovery><ParticipantIndex>auto</ParticipantIndex><MaxAutoParticipantIndex>" +
            std::to_string(kMaxParticipants) + "</MaxAutoParticipantIndex><Peers>";
    if (only_loopback) text += "<Peer address=\"127.0.0.1\"/>";
    for (const std::string& peer : gateway.peers) {
      text += "<Peer address=\"" + escaped(peer) + "\"/>";
    }
    text += "</Peers></Discovery>";
  }
  if (!result.empty()) result += ",";
  return result + text;
}

bool may_look_up_names(const Gateway& gateway) {
  const bool has_text =
      !gateway.configuration.empty() || (gateway.interfaces.empty() && gateway.peers.empty() &&
                                         std::getenv("CYCLONEDDS_URI") != nullptr);
  return has_text || !std::all_of(gateway.peers.begin(), gateway.peers.end(), is_address);
}

Domain::Domain(const Gateway& gateway, const std::set<std::string>& topics, const Bell& bell)
    : id_(domain_of(gateway)),
      domain_(open_domain(id_, gateway)),
      participant_(join(id_)),
      peers_(participant_.get(), topics, bell) {}

dds_entity_t Domain::participant(End end) {
  if (end == End::kWriter) return participant_.get();
  if (!readers_) {
    readers_ = join(id_);
    peers_.note_own(readers_.get());
  }
  return readers_.get();
}

CycloneWords::CycloneWords() { kept_words = &lines_; }
CycloneWords::~CycloneWords() { kept_words = nullptr; }

std::vector<std::string> CycloneWords::unknown_peers() const {
  constexpr std::string_view kBefore = "add_peer_addresses: ";
  constexpr std::string_view kBehind = ": unknown address";
  std::vector<std::string> result;
  for (const std::string& line : lines_) {
    const std::size_t before = line.find(kBefore);
    if (before == line.npos || !line.ends_with(kBehind)) continue;
    const std::size_t begin = before + kBefore.size();
    result.push_back(line.substr(begin, line.size() - kBehind.size() - begin));
  }
  return result;
}

void CycloneWords::tell() const {
  for (const std::string& line : lines_) say(Level::kWarning, "Cyclone DDS: " + line);
}

void hear_cyclone() {
  wait_by_steady_clock();
  // What strangers send may make it write: their number must not fill a disk.
  static Quota& quota = *new Quota(20, 10'000'000'000);
  // While an interface is down, each datagram is one.
  static Repeats& repeats = *new Repeats(60'000'000'000);
  dds_set_log_mask(DDS_LC_FATAL | DDS_LC_ERROR | DDS_LC_WARNING);
  dds_set_log_sink(
      [](void* /*argument*/, const dds_log_data_t* line) {
        std::string text(line->message, line->size);
        while (text.ends_with('\n') || text.ends_with('.')) text.pop_back();
        ConfigurationFile::name_in(text);
        if (kept_words != nullptr) {
          if (kept_words->size() == kMaxKept) kept_words->erase(kept_words->begin());
          kept_words->push_back(text);
          return;
        }
        const shm::Nanoseconds now = shm::monotonic_now();
        if (!repeats.is_due(text, now)) return;
        const auto passed = quota.take();
        if (!passed) return;
        const std::uint64_t again = repeats.note(text, now);
        const bool error = (line->priority & (DDS_LC_FATAL | DDS_LC_ERROR)) != 0;
        std::string said = "Cyclone DDS: " + text;
        if (again > 0) said += " (" + std::to_string(again) + " times more since it was said)";
        if (*passed > 0) said += " (" + std::to_string(*passed) + " lines were left out before)";
        say(error ? Level::kError : Level::kWarning, said);
      },
      nullptr);
}

}  // namespace arbiter::gateway::dds
