// A publisher of iceoryx that RouDi may refuse. With iceoryx's own, that ends the process.
#pragma once

#include <stdexcept>
#include <string>

#include <iceoryx_posh/popo/untyped_publisher.hpp>

namespace arbiter::gateway {

class RefusedByRoudi : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

// What iceoryx has found wrong last on this thread; empty: nothing.
inline thread_local std::string last_fault_of_iceoryx;

// Where RouDi refuses, the runtime gives no port, and says to the error handler why.
class RefusablePort : public iox::PublisherPortUserType {
 public:
  explicit RefusablePort(MemberType_t* port) : PublisherPortUser(demand(port)) {}

 private:
  static MemberType_t* demand(MemberType_t* port) {
    if (port == nullptr) throw RefusedByRoudi(last_fault_of_iceoryx);
    return port;
  }
};

// Its constructor throws RefusedByRoudi.
using Publisher = iox::popo::UntypedPublisherImpl<iox::popo::BasePublisher<RefusablePort>>;

}  // namespace arbiter::gateway
