# The page, on the embedded model: docker build --tag goalscope .
FROM python:3.13-slim
RUN apt-get update && apt-get install --yes --no-install-recommends libgomp1 && rm -rf /var/lib/apt/lists/*
RUN --mount=type=bind,target=/source,rw pip install --no-cache-dir "/source[web]"
RUN useradd --create-home goalscope
USER goalscope
# Episodes outlive the container.
VOLUME /home/goalscope
EXPOSE 8000
CMD ["goalscope", "serve", "--host", "0.0.0.0"]
