// What a daemon's successor reads of an entry that its predecessor was about to change
// (service/kept/registry_entry.hpp).
#include "service/kept/registry_entry.hpp"
#include "tests/explore/components.hpp"

namespace arbiter::explore::registry_cases {
namespace {

using service::Owner;

struct Entry {
  Entry() {
    entry.name("/one");
    entry.set_owner({1, 11, {111, 1111}});
  }
  service::RegistryEntry entry{};
};

void rename(const Explore& explore) {
  explore_anew<Entry>(explore, [](Entry& registered, Execution& execution) {
    execution.mortal_thread([&registered] { registered.entry.name("/two/which/is/longer"); });
    execution.thread([&registered] {
      const std::string name = registered.entry.name();
      require(name.empty() || name == "/one" || name == "/two/which/is/longer",
              "a name was read half changed");
    });
  });
}
const Register kNames("ANameIsReadWholeOrNotAtAll", {2, 1, 1}, rename);

void change_owner(const Explore& explore) {
  explore_anew<Entry>(explore, [](Entry& registered, Execution& execution) {
    execution.mortal_thread([&registered] { registered.entry.set_owner({2, 22, {222, 2222}}); });
    execution.thread([&registered] {
      const Owner owner = registered.entry.owner();
      const auto is = [&](std::uint64_t digit) {
        return owner.port == digit && owner.node == digit * 11 &&
               owner.process.pid == static_cast<pid_t>(digit * 111) &&
               owner.process.started == digit * 1111;
      };
      require(owner.port == 0 || is(1) || is(2), "an owner was read half changed");
    });
  });
}
const Register kOwners("AnOwnerIsReadWholeOrNotAtAll", {3, 3, 1}, change_owner);

}  // namespace
}  // namespace arbiter::explore::registry_cases
