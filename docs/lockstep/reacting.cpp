// A node in C++ that reacts in a callback: each odometry is answered by one command.
#include <geometry_msgs/Twist.h>
#include <nav_msgs/Odometry.h>
#include <ros/ros.h>

int main(int argc, char** argv) {
  ros::init(argc, argv, "reacting_cpp");
  ros::NodeHandle node;
  auto commands = node.advertise<geometry_msgs::Twist>("drone/cmd_vel", 1);
  boost::function<void(const nav_msgs::Odometry&)> fly = [&](const nav_msgs::Odometry& odometry) {
    const double goal[] = {1.0, 0.5, 1.5}, gain = 0.4;  // m, 1/s
    const auto& here = odometry.pose.pose.position;
    geometry_msgs::Twist command;
    command.linear.x = gain * (goal[0] - here.x);
    command.linear.y = gain * (goal[1] - here.y);
    command.linear.z = gain * (goal[2] - here.z);
    commands.publish(command);
  };
  auto odometry = node.subscribe<nav_msgs::Odometry>("drone/odom", 1, fly, ros::VoidConstPtr(), ros::TransportHints().tcpNoDelay());
  ros::spin();
}
