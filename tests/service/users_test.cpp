// The policy, with processes of different users.
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/stat.h>

#include <filesystem>

#include <arbiter/arbiter.hpp>

#include "tests/support/daemon.hpp"
#include "tests/support/other_user.hpp"

namespace arbiter::test {
namespace {

using testing::HasSubstr;
using testing::StartsWith;
using wire::MessageKind;

constexpr const char* kOneArm =
    "<behaviors><arbiter at='/Arm/in'><select from='/Arm/out'/></arbiter></behaviors>";

class Users : public testing::Test {
 protected:
  void SetUp() override {
    if (!may_be_another_user()) GTEST_SKIP() << "only root can start processes of other users";
  }

  // A daemon that processes of other users can reach.
  Daemon& start(const std::string& policy) {
    daemon_.emplace(kOneArm,
                    Daemon::Options{.arguments = {"--policy", files_.write("policy", policy)}});
    open_up();
    return *daemon_;
  }
  Daemon& start_without_policy() {
    daemon_.emplace(kOneArm);
    open_up();
    return *daemon_;
  }
  void write_policy(const std::string& text) { files_.write("policy", text); }
  [[nodiscard]] std::string policy_path() const { return files_.path() + "/policy"; }

  std::string open_output(const User& user, const std::string& name) {
    return as_user(user, [&] {
      Node node("actor");
      auto port = node.output_port<int>(name);
      return std::string("opened");
    });
  }
  std::string open_input(const User& user, const std::string& name) {
    return as_user(user, [&] {
      Node node("actor");
      auto port = node.input_port<int>(name);
      return std::string("opened");
    });
  }
  // "done", or why not.
  std::string ask(const User& user, MessageKind kind, const std::string& name = {}) {
    return as_user(user, [&] { return ask(daemon_->instance(), kind, name); });
  }
  static std::string ask(const std::string& instance, MessageKind kind, const std::string& name) {
    RawClient client(instance);
    client.hello("actor");
    client.send(RawClient::message(kind, name));
    client.expect(kind == MessageKind::kStatus ? MessageKind::kStatusReply : MessageKind::kDone);
    return "done";
  }

  TemporaryDirectory files_;
  std::optional<Daemon> daemon_;

 private:
  void open_up() { ASSERT_EQ(::chmod(daemon_->directory().c_str(), 0711), 0); }
};

TEST_F(Users, OpenThePortsThatTheirNameAllows) {
  start("allow user nobody output /Arm/*\nallow user 54321 input /Arm/in\n");
  EXPECT_EQ(open_output(kNobody, "/Arm/out"), "opened");
  EXPECT_EQ(open_input(kStranger, "/Arm/in"), "opened");
  EXPECT_THAT(
      open_output(kStranger, "/Arm/out"),
      HasSubstr("user 54321 may not open the output port /Arm/out: no line of " + policy_path() +
                " allows it; one that would: allow user 54321 output /Arm/out"));
  EXPECT_THAT(open_input(kNobody, "/Arm/in"),
              HasSubstr(" allows it; one that would: allow user nobody input /Arm/in"));
  EXPECT_THAT(open_input(kNobody, "/Arm/in"),
              HasSubstr("user nobody (65534) may not open the input port /Arm/in: "));
  EXPECT_THAT(open_output(kNobody, "/Leg/out"), HasSubstr("may not"));
  EXPECT_EQ(open_output({0}, "/Leg/out"), "opened") << "root, as no line says otherwise";
}

TEST_F(Users, AreRefusedByTheLineThatSaysSo) {
  start("# first the exceptions\ndeny user nobody output /Arm/*\nallow everyone all\n");
  EXPECT_THAT(open_output(kNobody, "/Arm/out"),
              HasSubstr(policy_path() + ":2 says: deny user nobody output /Arm/*"));
  EXPECT_EQ(open_output(kNobody, "/Leg/out"), "opened");
  EXPECT_EQ(open_output(kStranger, "/Arm/out"), "opened");
}

TEST_F(Users, OpenThePortsThatASupplementaryGroupAllows) {
  start("deny group 4243 all\nallow group 4242 output /Arm/*\n");
  EXPECT_EQ(open_output({54321, 54321, {4242}}, "/Arm/out"), "opened");
  EXPECT_EQ(open_output({54321, 4242}, "/Arm/out"), "opened") << "the primary group counts, too";
  EXPECT_THAT(open_output({54321, 54321, {4241}}, "/Arm/out"), HasSubstr("may not"));
  EXPECT_THAT(open_output({54321, 54321, {4242, 4243}}, "/Arm/out"), HasSubstr(":1 says: deny"));
  std::vector<gid_t> many;
  for (gid_t group = 4242; group < 4242 + 200; ++group) {
    if (group != 4243) many.push_back(group);
  }
  EXPECT_EQ(open_output({54321, 54321, many}, "/Arm/out"), "opened");
}

TEST_F(Users, AreToldApartInTheLog) {
  Daemon& daemon = start("allow user root all\n");
  pid_t pid = 0;
  const std::string said = as_user(kNobody, [&] {
    try {
      Node node("the-node");
      auto port = node.output_port<int>("/Arm/out");
    } catch (const Error&) {
    }
    return std::to_string(::getpid());
  });
  pid = std::stoi(said);
  daemon.status();  // behind which the line is in the log
  EXPECT_THAT(daemon.log(), HasSubstr("node \"the-node\" (pid " + std::to_string(pid) +
                                      "): user nobody (65534) may not open the output port "
                                      "/Arm/out: no line of "));
}

TEST_F(Users, ReloadStopDeactivateAndObserveAsThePolicySays) {
  Daemon& daemon = start(
      "allow user nobody reload,observe\nallow user 54321 deactivate /Arm/*\n"
      "allow user 54321 switch\n"
      "allow group 4242 stop\n");
  EXPECT_EQ(ask(kNobody, MessageKind::kReload), "done");
  EXPECT_EQ(daemon.generation(), 2u);
  EXPECT_EQ(ask(kNobody, MessageKind::kStatus), "done");
  EXPECT_EQ(ask(kNobody, MessageKind::kObserve), "done");
  EXPECT_EQ(ask(kStranger, MessageKind::kDeactivate, "/Arm/out"), "done");
  EXPECT_EQ(ask(kStranger, MessageKind::kSwitch, "default"), "done");
  EXPECT_THAT(ask(kNobody, MessageKind::kSwitch, "default"),
              HasSubstr("may not switch to another model"))
      << "reload does not imply it";
  EXPECT_EQ(ask(kStranger, MessageKind::kRollback),
            "user 54321 may not go back to an earlier model (the policy's action reload): no line "
            "of " +
                policy_path() + " allows it; one that would: allow user 54321 reload");
  for (const MessageKind kind :
       {MessageKind::kReload, MessageKind::kStatus, MessageKind::kObserve}) {
    EXPECT_THAT(ask(kStranger, kind), StartsWith("user 54321 may not "));
  }
  EXPECT_THAT(ask(kNobody, MessageKind::kDeactivate, "/Arm/out"),
              StartsWith("user nobody (65534) may not deactivate the source /Arm/out"));
  EXPECT_THAT(ask(kNobody, MessageKind::kStop), HasSubstr("may not stop the daemon"));
  EXPECT_EQ(daemon.generation(), 2u);
  EXPECT_EQ(ask({54321, 54321, {4242}}, MessageKind::kStop), "done");
  EXPECT_EQ(daemon.process().wait(), 0);
}

TEST_F(Users, WithoutAPolicyMayDoAllButReloadAndStop) {
  Daemon& daemon = start_without_policy();
  EXPECT_EQ(open_output(kNobody, "/Arm/out"), "opened");
  EXPECT_EQ(open_input(kNobody, "/Arm/in"), "opened");
  EXPECT_EQ(ask(kNobody, MessageKind::kStatus), "done");
  EXPECT_EQ(ask(kNobody, MessageKind::kObserve), "done");
  EXPECT_EQ(ask(kNobody, MessageKind::kDeactivate, "/Arm/out"), "done");
  EXPECT_THAT(ask(kNobody, MessageKind::kReload),
              HasSubstr("the default policy allows it to root"));
  EXPECT_THAT(ask(kNobody, MessageKind::kStop), HasSubstr("may not stop the daemon"));
  EXPECT_THAT(ask(kNobody, MessageKind::kSwitch, "default"),
              HasSubstr("may not switch to another model"));
  EXPECT_EQ(ask({0}, MessageKind::kReload), "done");
  EXPECT_EQ(daemon.generation(), 2u);
}

// Credentials are those that the kernel noted at connect(): nothing that a client sends changes
// them, not even what root's may send.
TEST_F(Users, CannotPretendToBeOthers) {
  start("allow user root output *\n");
  const auto forge = [this](const ucred& claimed) {
    RawClient client(daemon_->instance());
    client.hello("root");
    const auto message = RawClient::message(MessageKind::kReload);
    iovec data{const_cast<wire::Message*>(&message), offsetof(wire::Message, name)};
    alignas(cmsghdr) char control[CMSG_SPACE(sizeof(ucred))] = {};
    msghdr header{};
    header.msg_iov = &data;
    header.msg_iovlen = 1;
    header.msg_control = control;
    header.msg_controllen = sizeof control;
    cmsghdr* const part = CMSG_FIRSTHDR(&header);
    part->cmsg_level = SOL_SOCKET;
    part->cmsg_type = SCM_CREDENTIALS;
    part->cmsg_len = CMSG_LEN(sizeof(ucred));
    std::memcpy(CMSG_DATA(part), &claimed, sizeof claimed);
    if (::sendmsg(client.socket(), &header, MSG_NOSIGNAL) < 0) {
      return std::string("the kernel: ") + std::strerror(errno);
    }
    wire::Received reply;
    if (!client.receive(reply)) return std::string("(hung up)");
    return reply.message.kind == MessageKind::kDone ? std::string("done")
                                                    : std::string(reply.message.text_view());
  };
  EXPECT_EQ(as_user(kNobody,
                    [&] {
                      return forge({::getpid(), 0, 0});
                    }),
            "the kernel: Operation not permitted");
  EXPECT_THAT(as_user(kNobody,
                      [&] {
                        return forge({::getpid(), 65534, 65534});
                      }),
              StartsWith("user nobody (65534) may not reload the files"));
  EXPECT_EQ(forge({::getpid(), 65534, 65534}), "done") << "as root, who may name anybody";
}

TEST_F(Users, AreWhoTheyWereWhenTheyConnected) {
  start("allow user root output *\nallow user root observe\n");
  const auto connect_as = [this](uid_t user) {
    return as_user({0}, [&] {
      if (::seteuid(user) != 0) throw std::runtime_error("seteuid");
      RawClient client(daemon_->instance());
      client.hello("changeling");
      if (::seteuid(user == 0 ? 65534 : 0) != 0) throw std::runtime_error("seteuid");
      client.status();
      return std::string("done");
    });
  };
  EXPECT_EQ(connect_as(0), "done");
  EXPECT_THAT(connect_as(65534), StartsWith("user nobody (65534) may not observe"));
}

TEST_F(Users, KeepTheirPortsWhenThePolicyChanges) {
  Daemon& daemon = start("allow user root all\nallow user nobody output *\n");
  program_detail::Pipe opened, go;
  const pid_t child = ::fork();
  if (child == 0) {
    char byte = 0;
    int code = 1;
    try {
      if (!become(kNobody)) ::_exit(2);
      Node node("stays");
      auto port = node.output_port<int>("/Arm/out");
      if (::write(opened.ends[1], "x", 1) != 1 || ::read(go.ends[0], &byte, 1) != 1) ::_exit(3);
      port.publish(1);
      try {
        auto other = node.output_port<int>("/other");
      } catch (const Error&) {
        code = 0;
      }
    } catch (...) {
    }
    ::_exit(code);
  }
  char byte = 0;
  ASSERT_EQ(::read(opened.ends[0], &byte, 1), 1);
  write_policy("allow user root all\n");
  daemon.load(kOneArm);
  EXPECT_TRUE(daemon.source("/Arm/out")["open"]);
  ASSERT_EQ(::write(go.ends[1], "x", 1), 1);
  int status = 0;
  ASSERT_EQ(::waitpid(child, &status, 0), child);
  EXPECT_EQ(status, 0);
}

TEST_F(Users, AnswerToTheOldPolicyWhereTheNewOneIsBad) {
  Daemon& daemon = start("allow user nobody output /Arm/*\n");
  write_policy("allow everyone all\nallow everyone everything\n");
  daemon.load_bad("<behaviors/>");
  EXPECT_THAT(daemon.log(), HasSubstr(policy_path() + ":2:16: \"everything\" is no action"));
  EXPECT_EQ(daemon.generation(), 1u) << "neither does the model count that came with it";
  EXPECT_EQ(open_output(kNobody, "/Arm/out"), "opened");
  EXPECT_THAT(open_output(kStranger, "/Arm/out"), HasSubstr("may not"));
  // Nor does a good policy that comes with a bad model.
  write_policy("allow everyone all\n");
  daemon.load_bad("<behaviors>");
  EXPECT_THAT(open_output(kStranger, "/Arm/out"), HasSubstr("may not"));
  daemon.load(kOneArm);
  EXPECT_EQ(open_output(kStranger, "/Arm/out"), "opened");
}

}  // namespace
}  // namespace arbiter::test
