"""Examples of every function of simROS, in the form of api_examples.py."""

from api_examples import Example

ROS: dict[str, list[Example]] = {
    "subscribe": [Example("NAME('in', 'std_msgs/String', 'heard')", [1])] * 2,
    "subscriberTreatUInt8ArrayAsString": [Example("NAME(1)", [])],
    "shutdownSubscriber": [Example("NAME(1)", [])],
    "advertise": [Example("NAME('out', 'std_msgs/String')", [2])],
    "publisherTreatUInt8ArrayAsString": [Example("NAME(2)", [])],
    "getNumSubscribers": [Example("NAME(2)", [0])],
    "publish": [Example("NAME(2, MESSAGE)", [])],
    "shutdownPublisher": [Example("NAME(2)", [])],
    "imageTransportAdvertise": [Example("NAME('image')", [3])],
    "imageTransportPublish": [Example("NAME(3, '123456', 1, 2, 'camera')", [])],
    "imageTransportShutdownPublisher": [Example("NAME(3)", [])],
    "advertiseService": [
        Example("NAME('serve', 'std_srvs/Trigger', 'served')", [4]),
        Example(
            "REFUSED(NAME, 'serve', 'std_srvs/Trigger', 'served')",
            ["this script already offers the service /drone/serve"],
        ),
    ],
    "serviceServerTreatUInt8ArrayAsString": [Example("NAME(4)", [])],
    "shutdownServiceServer": [Example("NAME(4)", [])],
    "getTime": [Example("NAME()", [0])],
    "sendTransform": [Example("NAME(MESSAGE)", [])],
    "sendTransforms": [Example("NAME({MESSAGE})", [])],
    "setParamString": [Example("NAME('s', 'text')", [])],
    "getParamString": [Example("NAME('s')", [True, "text"]), Example("NAME('none', 'x')", [False, "x"])],
    "setParamInt": [Example("NAME('i', 2)", [])],
    "getParamInt": [Example("NAME('i')", [True, 2])],
    "setParamDouble": [Example("NAME('d', 2.5)", [])],
    "getParamDouble": [Example("NAME('d')", [True, 2.5])],
    "setParamBool": [Example("NAME('b', true)", [])],
    "getParamBool": [Example("NAME('b')", [True, True])],
    "hasParam": [Example("NAME('b')", [True])],
    "searchParam": [Example("NAME('b')", [True, "/drone/b"]), Example("NAME('none')", [False, ""])],
    "deleteParam": [Example("NAME('b')", []), Example("simROS.hasParam('b')", [False])],
    "serviceClient": [Example("NAME('reset', 'std_srvs/Trigger')", [1])],
    "serviceClientTreatUInt8ArrayAsString": [Example("NAME(1)", [])],
    "call": [Example("REFUSED(NAME, 1)", ["this flight runs without ROS, so there are no services"])],
    "shutdownServiceClient": [Example("NAME(1)", [])],
}
