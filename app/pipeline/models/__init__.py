"""Networks that the pipeline runs, as ONNX files."""
