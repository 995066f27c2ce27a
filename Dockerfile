# The whole package on ROS 2 Jazzy: docker build -t twbr_estimation . && docker run -it --net=host twbr_estimation
FROM ros:jazzy-ros-base

WORKDIR /robot_ws
COPY . src/twbr_estimation
# hadolint ignore=DL3008
RUN apt-get update && apt-get install -y --no-install-recommends python3-pip \
    && rosdep update --rosdistro jazzy \
    && PIP_BREAK_SYSTEM_PACKAGES=1 rosdep install --from-paths src --ignore-src -y --rosdistro jazzy \
    && . /opt/ros/jazzy/setup.sh && colcon build \
    && rm -rf /var/lib/apt/lists/*

RUN echo '. /robot_ws/install/setup.sh' >> /etc/bash.bashrc
CMD ["bash"]
