// DDS Security for links: nobody takes part without a certificate, and everything is encrypted.
#pragma once

#include <string>

namespace arbiter::link {

// Cyclone's configuration for it, in addition to all other. `folder` has identity_ca.pem,
// permissions_ca.pem, governance.p7s, permissions.p7s, NAME.pem and NAME_key.pem. Whether they are
// there and right is seen when a participant is made.
[[nodiscard]] std::string security_configuration(const std::string& folder,
                                                 const std::string& name);

}  // namespace arbiter::link
