"""The weights of SmolLM2-135M-Instruct: `SmolLM2-135M-Instruct.Q4_1.gguf`, beside this file."""
