#include "gateway/mapping/check_topics.hpp"

#include <map>
#include <string>

#include "gateway/mapping/partitions.hpp"
#include "rules/text/names.hpp"

namespace arbiter::gateway {
namespace {

struct Placed {
  const Gateway* gateway;
  const Entry* entry;
};

// A domain that is not named is the environment's, as it is here. What cannot be read there, the
// gateway says when it starts.
std::uint32_t domain_of(const Gateway& gateway) {
  return gateway.domain.value_or(domain_of_environment().value_or(0));
}

// A second or two: a gateway that reads its mapping again serves on the same thread.
constexpr std::size_t kMostCompared = 1'000'000'000;

// `patience`: as share_partition() has it.
bool are_one_topic(const Placed& one, const Placed& other, std::size_t& patience) {
  const Entry& a = *one.entry;
  const Entry& b = *other.entry;
  if (a.dds && b.dds) {
    return domain_of(*one.gateway) == domain_of(*other.gateway) && a.dds->name == b.dds->name &&
           share_partition(a.dds->qos.partitions, b.dds->qos.partitions, patience);
  }
  if (a.iceoryx && b.iceoryx) {
    return a.iceoryx->service == b.iceoryx->service && a.iceoryx->instance == b.iceoryx->instance &&
           a.iceoryx->event == b.iceoryx->event;
  }
  return false;
}

class TopicCheck {
 public:
  TopicCheck(const std::vector<Mapping>& mappings, rules::Diagnostics& diagnostics)
      : diagnostics_(diagnostics) {
    for (const Mapping& mapping : mappings) {
      for (const Gateway& gateway : mapping.gateways) {
        gateways_.push_back(&gateway);
        for (const Entry& entry : gateway.entries) {
          if (!entry.has_errors) by_topic_[entry.outside()].push_back({&gateway, &entry});
        }
      }
    }
  }

  // A program has one configuration for each domain, and is given a file as a whole. Whether it is
  // given several files nobody can see here.
  void check_configurations() {
    std::map<std::uint32_t, const Gateway*> known;
    for (const Gateway* gateway : gateways_) {
      if (gateway->kind != Kind::kDds) continue;
      const auto [found, is_new] = known.try_emplace(domain_of(*gateway), gateway);
      const Gateway& first = *found->second;
      if (is_new || have_one_configuration(first, *gateway)) continue;
      const bool is_one_file = first.where.file == gateway->where.file;
      const std::string text =
          "the gateway at " + rules::describe(first.where) + " joins domain " +
          std::to_string(found->first) +
          " with another interface, peers or configuration, but a program has one for each "
          "domain; give both the same";
      if (is_one_file) {
        diagnostics_.error("two-configurations", gateway->where,
                           text + ", or put them into files of their own, for a program each");
      } else {
        diagnostics_.warning("two-configurations", gateway->where,
                             text + ", or start a program for each of the two files");
      }
    }
  }

  void check_topics() {
    for (const auto& [topic, all] : by_topic_) {
      for (std::size_t i = 0; i < all.size(); ++i) {
        bool is_second_out = false;
        for (std::size_t j = 0; j < i && patience_ != 0; ++j) {
          check_pair(all[j], all[i], is_second_out);
        }
      }
    }
  }

 private:
  // `is_second_out`: another `out` of its topic was found before, and said: one is enough.
  void check_pair(const Placed& first, const Placed& second, bool& is_second_out) {
    const Entry& one = *first.entry;
    const Entry& other = *second.entry;
    if (one.is_in() == other.is_in() && (one.is_in() || is_second_out)) return;
    if (!are_one_topic(first, second, patience_)) return;
    if (patience_ == 0) {
      diagnostics_.error("too-many-partitions", second.entry->where,
                         "the entries of " + other.outside() +
                             " name too many partitions for each to be compared with the others; "
                             "name fewer");
    } else if (one.is_in() == other.is_in()) {
      is_second_out = true;
      report_two_outs(one, other);
    } else {
      report_circle(one.is_in() ? other : one, one.is_in() ? one : other);
    }
  }

  void report_circle(const Entry& out, const Entry& in) {
    diagnostics_.error(
        "circle", out.where,
        "what is sent to " + out.outside() + " comes in again by the entry at " +
            rules::describe(in.where) +
            "; publishers and subscribers must not meet past the gateway: remap one of them to "
            "another topic" +
            (out.dds ? ", partition or domain" : ""),
        {.ports = {out.port->name}});
  }

  void report_two_outs(const Entry& first, const Entry& second) {
    diagnostics_.warning("two-outs", second.where,
                         second.outside() + " has an entry already, at " +
                             rules::describe(first.where) +
                             ": its subscribers obey two input ports, which are arbitrated each "
                             "for itself; send one of them elsewhere",
                         {.ports = {second.port->name}});
  }

  rules::Diagnostics& diagnostics_;
  std::vector<const Gateway*> gateways_;
  std::map<std::string, std::vector<Placed>> by_topic_;  // in document order
  std::size_t patience_ = kMostCompared;
};

}  // namespace

void check_topics(const std::vector<Mapping>& mappings, rules::Diagnostics& diagnostics) {
  TopicCheck check(mappings, diagnostics);
  check.check_configurations();
  check.check_topics();
}

}  // namespace arbiter::gateway
