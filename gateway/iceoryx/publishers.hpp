// Who publishes what, as RouDi tells whoever asks: a subscriber of iceoryx does not see its
// publishers, nor a publisher others of its topic.
//
// Thread safety: one thread, the session's.
#pragma once

#include <string>
#include <vector>

#include <iceoryx_posh/popo/subscriber.hpp>
#include <iceoryx_posh/roudi/introspection_types.hpp>

#include "gateway/mapping/mapping.hpp"

namespace arbiter::gateway {

class Publishers {
 public:
  Publishers();

  // Takes RouDi's newest list. False: there is no newer one.
  bool update();
  // The names of the runtimes that publish on the topic, once for each publisher.
  [[nodiscard]] std::vector<std::string> of(const IceoryxTopic& topic) const;

 private:
  struct Publisher {
    std::string service, instance, event, runtime;
  };

  iox::popo::Subscriber<iox::roudi::PortIntrospectionFieldTopic> subscriber_;
  std::vector<Publisher> all_;
};

}  // namespace arbiter::gateway
