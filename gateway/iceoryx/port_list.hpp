// Who publishes and subscribes what, as RouDi tells whoever asks: a subscriber of iceoryx does not
// see its publishers, nor a publisher others of its topic, nor who asks for what it does not offer.
//
// Thread safety: one thread, the session's.
#pragma once

#include <string>
#include <vector>

#include <iceoryx_posh/popo/subscriber.hpp>
#include <iceoryx_posh/roudi/introspection_types.hpp>

#include "gateway/mapping/mapping.hpp"

namespace arbiter::gateway {

class PortList {
 public:
  PortList();

  // Takes RouDi's newest list. False: there is no newer one.
  bool update();
  // Whether RouDi has said something since the last call: it does so once a second.
  bool hears_roudi();
  // The names of the runtimes that have such an end of the topic, once for each end.
  [[nodiscard]] std::vector<std::string> publishers_of(const IceoryxTopic& topic) const;
  [[nodiscard]] std::vector<std::string> subscribers_of(const IceoryxTopic& topic) const;

 private:
  struct End {
    std::string service, instance, event, runtime;
  };

  [[nodiscard]] static End end_of(const iox::roudi::PortData& data);
  [[nodiscard]] static std::vector<std::string> those_of(const std::vector<End>& ends,
                                                         const IceoryxTopic& topic);

  iox::popo::Subscriber<iox::roudi::PortIntrospectionFieldTopic> news_;
  iox::popo::Subscriber<iox::roudi::PortThroughputIntrospectionFieldTopic> beat_;
  std::vector<End> publishers_;
  std::vector<End> subscribers_;
};

}  // namespace arbiter::gateway
