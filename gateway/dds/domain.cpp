#include "gateway/dds/domain.hpp"

#include <dds/ddsrt/log.h>

#include <charconv>
#include <cstdlib>
#include <cstring>
#include <string_view>

#include "gateway/core/say.hpp"
#include "gateway/dds/quota.hpp"

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

Entity join(dds_domainid_t domain) {
  return {dds_create_participant(domain, nullptr, nullptr),
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
  const char* const text = std::getenv("ROS_DOMAIN_ID");
  if (text == nullptr || *text == '\0') return 0;
  std::uint32_t domain = 0;
  const char* const end = text + std::strlen(text);
  const auto [rest, error] = std::from_chars(text, end, domain);
  if (error != std::errc() || rest != end || domain > kMaxDomain) {
    throw DdsError("ROS_DOMAIN_ID is \"" + std::string(text) +
                   "\": it must be a number from 0 to " + std::to_string(kMaxDomain));
  }
  return domain;
}

std::string configuration_of(const Gateway& gateway) {
  std::string result;
  if (!gateway.configuration.empty()) result = "file://" + gateway.configuration;
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

Domain::Domain(const Gateway& gateway, const std::set<std::string>& topics, const Bell& bell)
    : id_(domain_of(gateway)),
      domain_(dds_create_domain(id_, configuration_of(gateway).c_str()),
              "domain " + std::to_string(id_)),
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

void CycloneWords::tell() const {
  for (const std::string& line : lines_) say(Level::kWarning, "Cyclone DDS: " + line);
}

void hear_cyclone() {
  // What strangers send may make it write: their number must not fill a disk.
  static Quota& quota = *new Quota(20, 10'000'000'000);
  dds_set_log_mask(DDS_LC_FATAL | DDS_LC_ERROR | DDS_LC_WARNING);
  dds_set_log_sink(
      [](void* /*argument*/, const dds_log_data_t* line) {
        std::string_view text(line->message, line->size);
        while (text.ends_with('\n') || text.ends_with('.')) text.remove_suffix(1);
        if (kept_words != nullptr) {
          if (kept_words->size() == kMaxKept) kept_words->erase(kept_words->begin());
          kept_words->emplace_back(text);
          return;
        }
        if (const auto passed = quota.take(); passed) {
          const bool error = (line->priority & (DDS_LC_FATAL | DDS_LC_ERROR)) != 0;
          std::string said = "Cyclone DDS: " + std::string(text);
          if (*passed > 0) said += " (" + std::to_string(*passed) + " lines were left out before)";
          say(error ? Level::kError : Level::kWarning, said);
        }
      },
      nullptr);
}

}  // namespace arbiter::gateway::dds
