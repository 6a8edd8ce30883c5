#include "link/dds/security.hpp"

#include <cstdlib>
#include <filesystem>

#include "gateway/dds/domain.hpp"

namespace arbiter::link {
namespace {

// Debian has them in a folder of their own.
std::string plugin(const std::string& name) {
  const char* const folder = std::getenv("DDS_PLUGINS");
  return std::string(folder == nullptr ? ARBITER_DDS_PLUGINS : folder) + "/libdds_security_" +
         name + ".so";
}

std::string element(const std::string& name, const std::string& content) {
  return "<" + name + ">" + content + "</" + name + ">";
}

std::string library(const std::string& name, const std::string& what) {
  return "<Library path=\"" + gateway::dds::escaped(plugin(name)) + "\" initFunction=\"init_" +
         what + "\" finalizeFunction=\"finalize_" + what + "\"/>";
}

}  // namespace

std::string security_configuration(const std::string& folder, const std::string& name) {
  const auto file = [&](const std::string& each) {
    const auto path = std::filesystem::absolute(folder) / each;
    return "file:" + gateway::dds::escaped(path.lexically_normal());
  };
  return element(
      "Security",
      element("Authentication", library("auth", "authentication") +
                                    element("IdentityCA", file("identity_ca.pem")) +
                                    element("IdentityCertificate", file(name + ".pem")) +
                                    element("PrivateKey", file(name + "_key.pem"))) +
          element("AccessControl", library("ac", "access_control") +
                                       element("PermissionsCA", file("permissions_ca.pem")) +
                                       element("Governance", file("governance.p7s")) +
                                       element("Permissions", file("permissions.p7s"))) +
          element("Cryptographic", library("crypto", "crypto")));
}

}  // namespace arbiter::link
